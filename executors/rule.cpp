// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/rule.hpp"

namespace takt {

bool NamedCallback::is_called(std::string_view name) const noexcept {
  const std::string_view its_node = node.substr(1);
  if (name.starts_with('/')) name.remove_prefix(1);
  if (!name.starts_with(its_node) || name.size() <= its_node.size() ||
      name[its_node.size()] != '/') {
    return false;
  }
  name.remove_prefix(its_node.size() + 1);
  return name == callback || (callback.starts_with('/') && name == callback.substr(1));
}

}  // namespace takt
