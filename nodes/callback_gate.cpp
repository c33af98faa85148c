// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/callback_gate.hpp"

namespace takt {

thread_local constinit int CallbackGate::held_ = 0;

bool CallbackGate::reserve() noexcept {
  if (!is_open()) return false;  // so that callers do not delay the thread that closes
  if ((state_.fetch_add(kReserved) & kClosing) != 0) {
    leave(kReserved);
    return false;
  }
  ++held_;
  return true;
}

void CallbackGate::give_back() noexcept {
  --held_;
  leave(kReserved);
}

bool CallbackGate::enter() noexcept {
  --held_;
  if ((state_.fetch_add(kRunning - kReserved) & kClosed) == 0) return true;
  leave(kRunning);
  return false;
}

void CallbackGate::leave(std::uint32_t counted) noexcept {
  if ((state_.fetch_sub(counted) & kClosing) != 0) detail::WaitInCallback::notify_progress();
}

void CallbackGate::close() noexcept {
  using Wait = detail::WaitInCallback;
  const std::uint32_t own = detail::Running::depth_of(this);
  closings_.fetch_add(1, std::memory_order_relaxed);  // publishers read it together with kClosed
  state_.fetch_or(kClosing);
  const Wait wait(this, Wait::Whose::of_others);
  // Outside logical execution time, no user code runs between reserving and passing. So a thread
  // that closes while it holds a reservation has taken the inputs of a period.
  const auto waits_for = [&](std::uint32_t state) {
    if (wait.is_for_itself()) return false;
    return running(state) != own ||
           (reserved(state) != 0 && held_ == 0 && !Wait::is_anyone_waiting_in(&kPeriod));
  };
  wait.until([&] {
    std::uint32_t state = state_.load();
    while (!waits_for(state)) {
      if (state_.compare_exchange_weak(state, state | kClosed)) return true;
    }
    return false;
  });
}

}  // namespace takt
