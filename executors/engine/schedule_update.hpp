// How a change by a control thread reaches the workers: as an update, which a dispatch point
// installs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_SCHEDULE_UPDATE_HPP_
#define TAKT_EXECUTORS_ENGINE_SCHEDULE_UPDATE_HPP_

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "takt/base/lockfree/inbox.hpp"
#include "takt/entities/wait_in_callback.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt::detail {

/// Everything that depends on the set of callbacks. A control thread builds it, with all the memory
/// that will be needed. The executor installs it at a dispatch point, and leaves the replaced
/// objects in it, for a control thread to free. An update that only removes brings no memory and no
/// scheduler: the present ones have room for more callbacks than remain.
struct ScheduleUpdate {
  struct Parking {
    Exclusion* exclusion;
    std::unique_ptr<Scheduler> scheduler;
    ReadyCallback* parked = nullptr;  // during the exchange
  };
  struct Change {
    CallbackRecord* record;
    CallbackSettings settings;
  };
  bool only_removes = true;
  std::unique_ptr<Scheduler> scheduler;
  std::vector<Parking> parking;
  std::vector<std::pair<TimePoint, CallbackRecord*>> timers;  // reserved for all timers
  std::vector<CallbackRecord*> next_snapshot;                 // room for all
  std::vector<CallbackRecord*> added, removed;
  std::vector<Change> changed;  // in order: the last one applies
  std::vector<CallbackRecord*> all;
  std::vector<std::pair<CallbackRecord*, std::uint32_t>> levels;  // of all; empty: unchanged
  bool reads_clock = false;                                       // from now on
  std::vector<TriggerInput> rule_inputs;                          // with a rule: room for all
  std::shared_ptr<std::vector<Execution>> executions;  // with logical execution time: room for all
  ScheduleUpdate* inbox_next = nullptr;
};

/// Carries updates to the workers, and used ones back.
/// Thread safety: is_pending from any thread; send, take_back and free_used are serialised by the
/// executor's control threads, take and give_back at its dispatch points.
/// Real-time: nothing blocks; only free_used frees.
class Updates {
 public:
  Updates() = default;
  ~Updates() {
    take_back();
    free_used();
  }
  Updates(const Updates&) = delete;
  Updates& operator=(const Updates&) = delete;

  bool is_pending(std::memory_order order = std::memory_order_seq_cst) const noexcept {
    return pending_.load(order) != nullptr;
  }
  void send(std::unique_ptr<ScheduleUpdate> update) noexcept {
    pending_.store(update.release());
    WaitInCallback::notify_progress();
  }
  /// Withdraws an update that no worker has installed yet; nullptr: there is none.
  std::unique_ptr<ScheduleUpdate> take_back() noexcept {
    return std::unique_ptr<ScheduleUpdate>(pending_.exchange(nullptr));
  }
  void free_used() noexcept {
    for (ScheduleUpdate* update = used_.take_all(); update != nullptr;) {
      const std::unique_ptr<ScheduleUpdate> used(update);
      update = update->inbox_next;
    }
  }

  void give_back(ScheduleUpdate& used) noexcept {
    used_.push(used);
    WaitInCallback::notify_progress();
  }

 private:
  std::atomic<ScheduleUpdate*> pending_{nullptr};
  Inbox<ScheduleUpdate> used_;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_SCHEDULE_UPDATE_HPP_
