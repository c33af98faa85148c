// The ready callbacks of one executor, in the order of its scheduler, and its next snapshot.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_READY_QUEUE_HPP_
#define TAKT_EXECUTORS_ENGINE_READY_QUEUE_HPP_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/schedule_update.hpp"
#include "takt/executors/engine/selection.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt::detail {

/// The scheduler of an executor, with what waits in it; for wait sets, also what waits for the next
/// snapshot.
/// Thread safety: serialised by the executor ("at a dispatch point").
/// Real-time: nothing blocks or allocates; O(log n) a callback for heap-ordered schedulers.
class ReadyQueue {
 public:
  /// `rule`, `policy`: limit when, and by which worker, a callback may be taken; nullptr: there is
  /// none.
  ReadyQueue(Readiness readiness, const Rule* rule, const WorkersPolicy* policy,
             std::size_t workers, Watchdog* watchdog)
      : is_wait_set_(readiness == Readiness::wait_set),
        windows_ahead_(readiness == Readiness::wait_set ? 0 : 1),
        watchdog_(watchdog),
        selection_(rule, policy, workers) {}

  bool is_wait_set() const noexcept { return is_wait_set_; }
  Selection& selection() noexcept { return selection_; }
  const Selection& selection() const noexcept { return selection_; }
  /// No callback waits in the scheduler: a wait set's snapshot is finished.
  bool is_empty() const noexcept { return waiting_ == 0; }
  bool has_next_snapshot() const noexcept { return in_next_snapshot_ != 0; }

  /// The callback has become ready.
  void add(CallbackRecord& record) noexcept {
    is_wait_set_ ? add_to_next_snapshot(record) : push(record);
  }
  /// The same for what a polling point finds: of a wait set, it belongs to this snapshot.
  void push(CallbackRecord& record) noexcept;
  /// A wait set's polling point: what has become ready is the snapshot from now on.
  void begin_snapshot() noexcept;

  /// The first callback of the order, or nullptr.
  CallbackRecord* pop() noexcept;
  /// The same callback, which stays where it is.
  const CallbackRecord* peek() noexcept {
    return static_cast<const CallbackRecord*>(scheduler_->peek());
  }
  /// The callback that was popped is taken, or parked: its window is served.
  void serve_window_of(const CallbackRecord& record) noexcept {
    window_ = std::max(window_, record.window);
  }
  /// Gives the scheduler a callback back, with its old order of arrival.
  void hand_back(ReadyCallback& callback) noexcept;
  /// The same for several, linked by next.
  [[gnu::noinline]] void hand_back_all(ReadyCallback* first) noexcept;
  /// The group's first parked callback may compete again; nullptr: it has none.
  void unpark(ReadyCallback* callback) noexcept;
  /// Tells the scheduler how long a callback ran. `as_picked`: as it was popped.
  void report_execution(const ReadyCallback& as_picked, Nanoseconds execution_time) noexcept {
    scheduler_->done(as_picked, execution_time);
  }

  /// Empties the scheduler: what waited in it, linked by next in its order.
  ReadyCallback* take_all() noexcept;
  /// Installs the update's scheduler and memory, and leaves the old ones in it. Removed callbacks
  /// leave the next snapshot. The scheduler must be empty.
  void exchange(ScheduleUpdate& update) noexcept;

 private:
  void add_to_next_snapshot(CallbackRecord& record) noexcept {
    next_snapshot_[in_next_snapshot_++] = &record;
  }
  [[gnu::noinline]] void push_next_snapshot() noexcept;
  [[gnu::noinline]] void push_checked(CallbackRecord& record) noexcept;

  const bool is_wait_set_;
  // Without polling points, a callback that arrives now belongs to the window after the one that is
  // being served: so none starves under `ros`.
  const std::uint64_t windows_ahead_;
  Watchdog* const watchdog_;
  std::unique_ptr<Scheduler> scheduler_;
  Selection selection_;
  // Wait sets: what has become ready since the polling point. An array, because the links of a list
  // would be written into cache lines of records that another worker has.
  std::vector<CallbackRecord*> next_snapshot_;

  // Each dispatch writes these.
  alignas(64) std::size_t waiting_ = 0;  // in the scheduler
  std::uint64_t window_ = 0;
  std::size_t in_next_snapshot_ = 0;
};

// ---- The hot path: inline, so that a worker's dispatch is one function ----

inline void ReadyQueue::hand_back(ReadyCallback& callback) noexcept {
  ++waiting_;
  if (selection_.counts()) [[unlikely]]
    selection_.count(callback, 1);
  scheduler_->push(callback);
}

inline CallbackRecord* ReadyQueue::pop() noexcept {
  ReadyCallback* const first = scheduler_->pop();
  if (first == nullptr) return nullptr;
  --waiting_;
  if (selection_.counts()) [[unlikely]]
    selection_.count(*first, -1);
  return static_cast<CallbackRecord*>(first);
}

inline void ReadyQueue::push(CallbackRecord& record) noexcept {
  record.window = window_ + windows_ahead_;
  if (record.is_checked) [[unlikely]]
    return push_checked(record);
  hand_back(record);
}

inline void ReadyQueue::begin_snapshot() noexcept {
  if (selection_.is_open()) ++window_;  // what a closed rule holds becomes one snapshot
  if (in_next_snapshot_ != 0) push_next_snapshot();
}

inline void ReadyQueue::unpark(ReadyCallback* callback) noexcept {
  if (callback == nullptr) [[likely]]
    return;
  static_cast<CallbackRecord*>(callback)->state.unpark();
  hand_back(*callback);
}

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_READY_QUEUE_HPP_
