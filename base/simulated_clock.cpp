// SPDX-License-Identifier: Apache-2.0
#include "takt/base/simulated_clock.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

namespace takt {

std::shared_ptr<SimulatedClock> SimulatedClock::as_simulated() noexcept {
  if (auto shared = weak_from_this().lock()) return shared;
  return {std::shared_ptr<void>(), this};
}

TimePoint SimulatedClock::on_timeline(TimePoint time) const noexcept {
  if (time == kNever) return kNever;
  const std::lock_guard lock(mutex_);  // so that both values are from one moment
  return simulates() ? later(stands_.load(), between(now_.load(), time))
                     : later(time, ahead_.load());
}

void SimulatedClock::set(TimePoint now) noexcept {
  const std::lock_guard lock(mutex_);
  const TimePoint before = now_.exchange(now);
  const bool is_first = !std::exchange(has_time_, true);
  if (!simulates()) return;
  last_set_.store(real_.now());
  if (now > before && !is_first) stands_.store(later(stands_.load(), between(before, now)));
  notify(false);
}

void SimulatedClock::simulate(bool simulates) noexcept {
  const std::lock_guard lock(mutex_);
  if (simulates == this->simulates()) return;
  const TimePoint real = real_.now();
  if (simulates) {
    now_.store(TimePoint{});
    has_time_ = false;
    last_set_.store(real);
    stands_.store(later(real, ahead_.load()));
  } else {
    ahead_.store(stands_.load() - real);
  }
  source_.fetch_add(1);
  notify(true);
}

TimePoint SimulatedClock::real_time_of(TimePoint release) const noexcept {
  if (release == kNever) return kNever;
  if (simulates()) return release <= stands_.load() ? last_set_.load() : kNever;
  return later(release, -ahead_.load());
}

TimePoint SimulatedClock::timeline_at(TimePoint real) const noexcept {
  return simulates() ? stands_.load() : later(real, ahead_.load());
}

void SimulatedClock::notify(bool is_switched) noexcept {
  for (Listener* listener : listeners_) listener->time_set(is_switched);
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
