// SPDX-License-Identifier: Apache-2.0
#include "takt/callback_groups/callback_group.hpp"

namespace takt {

bool CallbackGroup::claim(const void* owner) noexcept {
  const void* nobody = nullptr;
  return owner_.compare_exchange_strong(nobody, owner);
}

void CallbackGroup::release(const void* owner) noexcept {
  owner_.compare_exchange_strong(owner, nullptr);
}

}  // namespace takt
