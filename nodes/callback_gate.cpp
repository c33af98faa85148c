// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/callback_gate.hpp"

namespace takt {

thread_local constinit const CallbackGate::Passage* CallbackGate::Passage::innermost_ = nullptr;
thread_local constinit int CallbackGate::held_ = 0;

bool CallbackGate::reserve() noexcept {
  if (!is_open()) return false;  // so that callers do not disturb the thread that waits
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

void CallbackGate::leave(std::uint32_t counted) noexcept {
  if ((state_.fetch_sub(counted) & kClosing) != 0) state_.notify_all();
}

CallbackGate::Passage::Passage(CallbackGate& gate) noexcept : gate_(&gate) {
  --held_;
  if ((gate.state_.fetch_add(kRunning - kReserved) & kClosed) != 0) {
    gate.leave(kRunning);
    gate_ = nullptr;
  } else {
    outer_ = innermost_;
    innermost_ = this;
  }
}

CallbackGate::Passage::~Passage() {
  if (gate_ == nullptr) return;
  innermost_ = outer_;
  gate_->leave(kRunning);
}

std::uint32_t CallbackGate::own_passages() const noexcept {
  std::uint32_t count = 0;
  for (const Passage* passage = Passage::innermost_; passage != nullptr;
       passage = passage->outer_) {
    if (passage->gate_ == this) ++count;
  }
  return count;
}

void CallbackGate::close() noexcept {
  const std::uint32_t own = own_passages();
  closings_.fetch_add(1, std::memory_order_relaxed);  // for publishers, which see it with kClosed
  std::uint32_t state = state_.fetch_or(kClosing) | kClosing;
  for (;;) {
    // Outside logical execution time no user's code runs between reserving and passing, so a thread
    // that comes here with a reservation has taken a period's inputs.
    if (running(state) == own && (reserved(state) == 0 || held_ != 0)) {
      if (state_.compare_exchange_weak(state, state | kClosed)) return;
    } else {
      state_.wait(state);
      state = state_.load();
    }
  }
}

}  // namespace takt
