// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

namespace takt {

ComponentRegistry& components() {
  static ComponentRegistry registry("component");
  return registry;
}

}  // namespace takt
