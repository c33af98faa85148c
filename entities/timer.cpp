// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/timer.hpp"

#include <algorithm>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"

namespace takt {

Timer::Timer(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
             Nanoseconds period, std::function<void()> callback)
    : Entity(EntityKind::timer, std::move(name), std::move(group)),
      clock_(clock.timeline()),
      simulated_(clock.as_simulated()),
      period_(period),
      callback_(std::move(callback)),
      next_release_(later(clock_.now(), period)) {
  if (period <= Nanoseconds::zero()) {
    throw Error("a timer's period must be positive, not " + to_string(period));
  }
  if (!callback_) throw Error("timer '" + this->name() + "' has no callback");
  if (simulated_ != nullptr) simulated_->add(*this);
}

Timer::~Timer() {
  if (simulated_ != nullptr) simulated_->remove(*this);
}

TimePoint Timer::real_time_of(TimePoint release) const noexcept {
  return simulated_ == nullptr ? release : simulated_->real_time_of(release);
}

void Timer::time_set(bool is_switched) noexcept {
  if (is_switched || ready_count() != 0) notify_release_changed();
}

void Timer::notify_release_changed() noexcept {
  const ReadSection section;
  if (Sink* sink = this->sink()) sink->release_changed();
}

void Timer::release_at(TimePoint release) noexcept {
  is_given_.store(true);
  next_release_.store(std::max(release, TimePoint{}));  // all clocks begin then
  notify_release_changed();
}

void Timer::cancel() noexcept {
  release_at(kNever);
}

void Timer::reset() noexcept {
  is_given_.store(false);
  next_release_.store(later(clock_.now(), period_));
  notify_release_changed();
}

// release_at may set a release meanwhile, which must stay: it sets is_given_ before it changes
// next_release_.
void Timer::begin_phase() noexcept {
  const TimePoint first = later(clock_.now(), period_);
  TimePoint release = next_release_.load();
  while (!is_given_.load() && !next_release_.compare_exchange_weak(release, first)) {
  }
  notify_release_changed();
}

void Timer::restart() noexcept {
  const TimePoint first = later(clock_.now(), period_);
  TimePoint release = next_release_.load();
  while (release != kNever && !next_release_.compare_exchange_weak(release, first)) {
  }
}

std::size_t Timer::ready_count() const noexcept {
  const TimePoint due = next_release_.load(), now = clock_.now();
  if (due > now) return 0;
  const std::size_t most = most_releases_.load();
  return most == 1 ? 1 : std::min(static_cast<std::size_t>((now - due) / period_) + 1, most);
}

bool Timer::take(Slot& slot) noexcept {
  const TimePoint now = clock_.now();
  TimePoint due = next_release_.load();
  for (;;) {
    if (due > now) return false;  // cancelled or reset since it became ready
    const auto most_behind = most_releases_.load(std::memory_order_relaxed) - 1;
    const auto missed = std::max<Nanoseconds::rep>((now - due) / period_ - most_behind, 0);
    if (next_release_.compare_exchange_weak(due, later(due + missed * period_, period_))) {
      missed_.fetch_add(static_cast<std::uint64_t>(missed), std::memory_order_relaxed);
      slot.ready_time = real_time_of(due);
      slot.expected_period = period_;
      return true;
    }
  }
}

void Timer::skip_releases(TimePoint until) noexcept {
  if (simulated_ != nullptr) until = simulated_->timeline_at(until);
  TimePoint due = next_release_.load();
  while (due < until) {
    const auto skipped = (until - due - Nanoseconds(1)) / period_;
    if (next_release_.compare_exchange_weak(due, later(due + skipped * period_, period_))) {
      missed_.fetch_add(static_cast<std::uint64_t>(skipped) + 1, std::memory_order_relaxed);
      return;
    }
  }
}

void Timer::execute(Slot&) {
  callback_();
}

}  // namespace takt
