// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/callback_list.hpp"

namespace takt::detail {

bool RemovableBase::begin_call() noexcept {
  std::uint32_t state = state_.load();
  do {
    if ((state & kRemoved) != 0) return false;
  } while (!state_.compare_exchange_weak(state, state + kCall));
  return true;
}

void RemovableBase::end_call() noexcept {
  if (state_.fetch_sub(kCall) == (kCall | kRemoved)) finish();
}

void RemovableBase::finish() noexcept {
  destroy_function();
  state_.fetch_or(kGone);
  WaitInCallback::notify_progress();
}

bool RemovableBase::remove() noexcept {
  const std::uint32_t before = state_.fetch_or(kRemoved);
  if (before == 0) {
    finish();
  } else if (!is_gone()) {
    const WaitInCallback wait(this);
    wait.until([&] { return wait.is_for_itself() || is_gone(); });
  }
  return (before & kRemoved) == 0;
}

}  // namespace takt::detail
