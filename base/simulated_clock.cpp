// SPDX-License-Identifier: Apache-2.0
#include "takt/base/simulated_clock.hpp"

#include <algorithm>
#include <mutex>

namespace takt {

void SimulatedClock::set(TimePoint now) noexcept {
  const std::lock_guard lock(mutex_);
  last_set_.store(real_.now());
  const Nanoseconds change = now - now_.exchange(now);
  for (Listener* listener : listeners_) listener->time_set(change);
}

void SimulatedClock::add(Listener& listener) {
  const std::lock_guard lock(mutex_);
  listeners_.push_back(&listener);
}

void SimulatedClock::remove(Listener& listener) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase(listeners_, &listener);
}

}  // namespace takt
