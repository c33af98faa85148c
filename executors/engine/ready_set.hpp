// How callbacks of one executor become ready, and which is next: readiness × scheduler.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_READY_SET_HPP_
#define TAKT_EXECUTORS_ENGINE_READY_SET_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "takt/base/clock.hpp"
#include "takt/base/lockfree/inbox.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/engine/ready_queue.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/schedule_update.hpp"
#include "takt/executors/engine/selection.hpp"
#include "takt/executors/engine/timer_queue.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/watchdog.hpp"

namespace takt::detail {

/// Collects what becomes ready, and gives it out in the order of the scheduler.
/// Thread safety: announce and has_announcements from any thread; all else is
/// serialised by the executor ("at a dispatch point").
/// Real-time: nothing blocks or allocates; O(log n) a callback for heap-ordered schedulers.
class ReadySet {
 public:
  /// `exact_time`: the clock is read after every callback, to report to the scheduler how long it
  /// ran. Otherwise only to look for due timers: when nothing else is ready, and about every two
  /// microseconds, see TimerQueue. `keeps_history`: a pop changes the scheduler's later choices, so
  /// has_another must not try one. `rule`, `policy`: limit when, and by which worker, a callback
  /// may be taken; nullptr: there is none.
  ReadySet(Readiness readiness, Clock& clock, bool exact_time, bool keeps_history, const Rule* rule,
           const WorkersPolicy* policy, std::size_t workers, Watchdog* watchdog)
      : keeps_history_(keeps_history),
        exact_time_(exact_time),
        queue_(readiness, rule, policy, workers, watchdog),
        timers_(clock) {}

  TimerQueue& timers() noexcept { return timers_; }
  ReadyQueue& queue() noexcept { return queue_; }
  const ReadyQueue& queue() const noexcept { return queue_; }
  Selection& selection() noexcept { return queue_.selection(); }

  /// Whether the clock is read at every dispatch. An update may turn it on.
  bool exact_time() const noexcept { return exact_time_.load(std::memory_order_relaxed); }

  /// Any thread: an entity became ready, or a timer's release time has changed. Returns true if a
  /// worker may have to be woken for it.
  bool announce(CallbackRecord& record, const Arrival& arrival) noexcept {
    if (!RecordState::announce(record.is_announced))
      return false;  // most announcements of a busy callback end here
    record.announced = arrival;
    inbox_.push(record);
    return !queue_.selection().is_logical();
  }
  /// The same on the only worker, in a callback: it needs no inbox.
  void announce_from_worker(CallbackRecord& record, const Arrival& arrival) noexcept {
    if (record.state.make_ready(record.is_announced)) enqueue(record, arrival);
  }
  /// Whether there are announcements for which a worker has to wake up.
  bool has_announcements() const noexcept {
    return !queue_.selection().is_logical() && !inbox_.empty();
  }

  /// Installs the update, and leaves in it the objects that it replaces.
  void install(ScheduleUpdate& update) noexcept;
  /// Takes removed records out of the inbox. Nobody announces them any more.
  void discard_removed() noexcept;

  /// What `next` may do.
  struct Limits {
    std::uint64_t last_sequence = UINT64_MAX;    // events: run nothing that arrived later
    bool may_poll = true;                        // look for new announcements and due timers
    std::size_t worker = Selection::kAnyWorker;  // the asking one, if a policy tells workers apart
  };
  /// The callback to run next, or nullptr. Its execution has begun, and ends with `finished`.
  CallbackRecord* next(const Limits& limits) noexcept;
  /// The first step of `next`, for a caller that takes several callbacks before it executes them:
  /// the groups are not asked, and the record stays ready.
  CallbackRecord* pick(const Limits& limits) noexcept;
  /// Where workers interrupt each other: the worker that may begin the next callback of the order.
  std::optional<std::size_t> worker_for_next() noexcept;
  /// Whether another worker would find a callback to run now. Parks the ready callbacks of busy
  /// groups, as that worker would do.
  [[gnu::noinline]] bool has_another() noexcept;
  /// Takes a snapshot, unless the last one is unfinished.
  void take_snapshot() noexcept {
    if (!queue_.is_wait_set() || queue_.is_empty()) poll();
  }
  /// Whether a polling point would find more than timers.
  bool has_more() const noexcept { return queue_.has_next_snapshot() || !inbox_.empty(); }
  /// Looks for announcements and due timers: a polling point.
  void poll() noexcept;

  /// After take, in a reentrant group: what remains may run on another worker now.
  void taken(CallbackRecord& record, bool more) noexcept {
    if (!record.state.is_removed()) settle(record, more, 0);
  }
  /// After execute, if exact_time(). `as_picked`: a copy of the record from when it was picked.
  void report_execution(const CallbackRecord& record, const ReadyCallback& as_picked,
                        Nanoseconds execution_time) noexcept {
    // The update that removed the callback may have brought a scheduler that does not know it.
    if (!record.state.is_removed()) queue_.report_execution(as_picked, execution_time);
  }
  /// The last step of an execution. `more`: as take has reported. A removed record may be freed
  /// then: the caller must not use it any more.
  void finished(CallbackRecord& record, bool more) noexcept;

  /// Gives back what `next` has put aside because of Limits::last_sequence.
  void restore_deferred() noexcept { queue_.hand_back_all(std::exchange(deferred_, nullptr)); }

  /// When the first timer is due, or when the rule must look if that is earlier; kNever: neither.
  TimePoint next_release() const noexcept {
    if (queue_.selection().is_needed()) [[unlikely]]
      return queue_.selection().release_or_opening(timers_.next_release(), !queue_.is_empty());
    return timers_.next_release();
  }
  /// The same for the timers that match: O(timers).
  template <class Matches>
  TimePoint next_release_of(Matches&& matches) const noexcept {
    return queue_.selection().release_or_opening(timers_.next_release_of(matches),
                                                 !queue_.is_empty());
  }

 private:
  [[gnu::noinline]] CallbackRecord* next_to_interrupt(const Limits& limits) noexcept;
  void enqueue(CallbackRecord& record, const Arrival& arrival) noexcept;
  void settle(CallbackRecord& record, bool more, std::uint32_t ended) noexcept;
  [[gnu::cold, gnu::noinline]] void end_removed(CallbackRecord& record) noexcept;
  [[gnu::noinline]] void drain_inbox() noexcept;
  [[gnu::noinline]] void release_due_timers() noexcept;

  const bool keeps_history_;
  std::atomic<bool> exact_time_;  // written at a dispatch point
  ReadyQueue queue_;              // it ends with what each dispatch writes: a cache line

  // Each dispatch writes these: another one.
  alignas(64) ReadyCallback* deferred_ = nullptr;  // linked by next
  TimerQueue timers_;

  alignas(64) Inbox<CallbackRecord> inbox_;  // any thread writes it
};

// ---- The hot path: inline, so that a worker's dispatch is one function ----

// A worker has found the record ready. `arrival`: of the input that it takes next.
inline void ReadySet::enqueue(CallbackRecord& record, const Arrival& arrival) noexcept {
  if (queue_.is_wait_set() && !inbox_.empty()) drain_inbox();  // they came before
  record.arrived(arrival);
  queue_.add(record);
}

inline void ReadySet::poll() noexcept {
  if (!inbox_.empty()) drain_inbox();
  if (queue_.is_wait_set()) queue_.begin_snapshot();
  if (timers_.must_look(exact_time() || queue_.is_empty())) release_due_timers();
}

inline CallbackRecord* ReadySet::pick(const Limits& limits) noexcept {
  if (limits.may_poll) take_snapshot();
  CallbackRecord* const first = queue_.pop();
  if (first != nullptr) queue_.serve_window_of(*first);
  return first;
}

inline CallbackRecord* ReadySet::next(const Limits& limits) noexcept {
  Selection& selection = queue_.selection();
  const bool selects = selection.is_needed();
  if (selects && selection.interrupts() && limits.worker != Selection::kAnyWorker) [[unlikely]]
    return next_to_interrupt(limits);
  CallbackRecord* record = nullptr;
  while ((record = pick(limits)) != nullptr) {
    if (record->sequence > limits.last_sequence) {
      record->next = std::exchange(deferred_, record);
    } else if (selects && selection.puts_aside(*record, limits.worker)) [[unlikely]] {
      continue;
    } else if (record->exclusion->admit(*record)) {
      record->state.begin();
      break;
    } else {
      record->state.park();
    }
  }
  if (selects) [[unlikely]]
    queue_.hand_back_all(selection.take_passed_over());
  return record;
}

// The record has been served: it goes to the scheduler again if it has more.
inline void ReadySet::settle(CallbackRecord& record, bool more, std::uint32_t ended) noexcept {
  const bool is_ready = record.state.settle(record.is_announced, more, ended,
                                            [&] { return record.entity->ready_count() != 0; });
  if (record.is_timer()) return timers_.arm(record);
  if (!is_ready) return;
  Arrival arrival{};
  if (!record.entity->front(arrival)) arrival = {next_sequence(), timers_.now()};
  enqueue(record, arrival);
}

inline void ReadySet::finished(CallbackRecord& record, bool more) noexcept {
  if (record.state.is_removed()) [[unlikely]]
    return end_removed(record);
  if (record.is_reentrant()) {
    record.state.end_execution();
    return;
  }
  settle(record, more, 1);
  queue_.unpark(record.exclusion->leave());
}

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_READY_SET_HPP_
