// SPDX-License-Identifier: Apache-2.0
#include "takt/callback_groups/callback_group.hpp"

#include <utility>

namespace takt {

bool CallbackGroup::claim(const void* owner) noexcept {
  const void* nobody = nullptr;
  return owner_.compare_exchange_strong(nobody, owner);
}

void CallbackGroup::release(const void* owner) noexcept {
  owner_.compare_exchange_strong(owner, nullptr);
}

std::unique_ptr<Scheduler> CallbackGroup::set_parking(std::unique_ptr<Scheduler> parking) noexcept {
  if (parking_ != nullptr) {
    while (ReadyCallback* parked = parking_->pop()) parking->push(*parked);
  }
  return std::exchange(parking_, std::move(parking));
}

}  // namespace takt
