// The idle timers of one executor, by their next release, and when it looks at the clock for them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_TIMER_QUEUE_HPP_
#define TAKT_EXECUTORS_ENGINE_TIMER_QUEUE_HPP_

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/executors/engine/record.hpp"

namespace takt::detail {

/// Which timer is due, and when the next one will be.
/// Thread safety: release_timers and timers_are_held from any thread; all else is serialised by the
/// executor.
/// Real-time: nothing blocks or allocates; arm and take_due are O(log n), rearm and exchange O(n).
class TimerQueue {
 public:
  using Entries = std::vector<std::pair<TimePoint, CallbackRecord*>>;

  explicit TimerQueue(Clock& clock) : clock_(clock) {}

  // ---- The clock ----

  /// The time as of the last reading, for callers that just read the clock (full statistics).
  void set_now(TimePoint now) noexcept { now_ = now; }
  TimePoint now() const noexcept { return now_; }
  void read_clock() noexcept { now_ = clock_.now(); }
  /// Asked at each dispatch: whether to look for due timers now. `at_once`: looks whatever the
  /// pace.
  bool must_look(bool at_once) noexcept {
    return !entries_.empty() && (at_once || --dispatches_until_look_ == 0);
  }
  /// Reads the clock, and restarts the count to the next look.
  void look_at_clock() noexcept;

  // ---- The timers ----

  /// The timer has become idle: queues its next release.
  void arm(CallbackRecord& record) noexcept;
  /// The release times of these, linked by next, have changed.
  void rearm(ReadyCallback* first) noexcept;
  /// The timer that is due first, and since when; nullptr when none is due by now().
  CallbackRecord* take_due(TimePoint& due) noexcept {
    return entries_.empty() || entries_.front().first > now_ ? nullptr : take_first(due);
  }
  /// When the first timer is due, kNever when there is none.
  TimePoint next_release() const noexcept {
    return entries_.empty() || timers_are_held() ? kNever : entries_.front().first;
  }
  /// The first of those that match (`bool(const CallbackRecord&, TimePoint release)`). O(n).
  template <class Matches>
  TimePoint next_release_of(Matches&& matches) const noexcept {
    TimePoint first = kNever;
    if (timers_are_held()) return first;
    for (const auto& [release, record] : entries_) {
      if (release < first && matches(*record, release)) first = release;
    }
    return first;
  }
  /// When a second worker may be needed, besides the one that wakes up for the first timer: that
  /// timer is due again, or one of another group is due. An estimate; kNever: unknown.
  TimePoint release_beside_first() const noexcept;
  void release_timers(bool released) noexcept { are_held_.store(!released); }
  bool timers_are_held() const noexcept { return are_held_.load(); }

  /// Keeps the timers that were not removed; moves them into `memory`, if that is larger.
  void exchange(Entries& memory, const std::vector<CallbackRecord*>& removed) noexcept;

 private:
  CallbackRecord* take_first(TimePoint& due) noexcept;

  Clock& clock_;
  Entries entries_;  // a heap, the first due in front
  std::atomic<bool> are_held_{false};
  TimePoint now_{};
  std::uint32_t dispatches_until_look_ = 1, dispatches_between_looks_ = 1;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_TIMER_QUEUE_HPP_
