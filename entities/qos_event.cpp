// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/qos_event.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

namespace takt {

void DeadlineEvent::look() {
  const TimePoint last = events_->last_message();
  if (last == TimePoint{}) return;
  DeadlineMissedStatus status;
  {
    const std::lock_guard lock(mutex_);
    const TimePoint now = clock().now();
    TimePoint due = later(std::max(last, missed_), period());
    if (due <= now) {
      const auto further = (now - due) / period();
      missed_ = due + further * period();
      events_->missed_deadlines(static_cast<std::uint64_t>(further) + 1);
      reported_ = status = events_->status(reported_);
      due = later(missed_, period());
    }
    release_at(due);
  }
  if (status.total_count_change != 0) callback_(status);
}

// The period does not matter: look() sets each release.
LivelinessEvent::LivelinessEvent(std::string name, std::shared_ptr<CallbackGroup> group,
                                 Clock& clock, std::shared_ptr<EndpointEvents> events,
                                 Callback callback)
    : Timer(std::move(name), std::move(group), clock, std::chrono::hours(24 * 365),
            [this] { look(); }),
      events_(std::move(events)),
      callback_(std::move(callback)) {
}

void LivelinessEvent::start() noexcept {
  events_->set_listener(LivelinessChangedStatus::kEvent, this);
  happened();
}

void LivelinessEvent::retire() noexcept {
  events_->remove_listener(LivelinessChangedStatus::kEvent, this);
  wait_for_readers();
  Timer::retire();
}

void LivelinessEvent::happened() noexcept {
  has_happened_.store(true);
  release_at(clock().now());
}

void LivelinessEvent::look() {
  LivelinessChangedStatus status;
  {
    const std::lock_guard lock(mutex_);
    has_happened_.store(false);
    const TimePoint next = events_->look_for_leases(clock().now());
    reported_ = status = events_->status(reported_);
    release_at(next);
    if (has_happened_.load()) release_at(clock().now());  // an event came during the look
  }
  if (status.alive_count_change != 0 || status.not_alive_count_change != 0) callback_(status);
}

}  // namespace takt
