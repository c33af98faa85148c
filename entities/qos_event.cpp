// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/qos_event.hpp"

#include <algorithm>
#include <mutex>

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

}  // namespace takt
