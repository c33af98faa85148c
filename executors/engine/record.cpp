// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/record.hpp"

#include "takt/executors/engine/wait_in_callback.hpp"

namespace takt::detail {

void CallbackRecord::notify_over() noexcept {
  state.notify_over();
  WaitInCallback::notify_progress();
}

bool is_called(const CallbackRecord& record, std::string_view name) noexcept {
  const std::string_view node = std::string_view(record.supervision->node).substr(1);
  const std::string_view callback = record.supervision->callback;
  if (name.starts_with('/')) name.remove_prefix(1);
  if (!name.starts_with(node) || name.size() <= node.size() || name[node.size()] != '/')
    return false;
  name.remove_prefix(node.size() + 1);
  return name == callback || (callback.starts_with('/') && name == callback.substr(1));
}

bool must_be_checked(const CallbackRecord& record, const CallbackSettings& settings) noexcept {
  return settings.info.deadline != Nanoseconds::zero() ||
         settings.info.budget != Nanoseconds::zero() ||
         settings.overrun != OverrunPolicy::catch_up || record.supervision->on_overrun ||
         !record.entity->chain_steps().empty();
}

}  // namespace takt::detail
