// What an executor counts, measures, traces and checks of its callbacks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_
#define TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/engine/dispatch_lock.hpp"
#include "takt/executors/engine/past_statistics.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/workers.hpp"
#include "takt/executors/executor.hpp"

namespace takt::detail {

/// What a thread has used so far, or for one execution.
struct ThreadUsage {
  Nanoseconds cpu_time{0};
  std::int64_t waits = 0;  // how often it gave up the CPU by itself; not where it was preempted
  ThreadUsage operator-(const ThreadUsage& before) const noexcept {
    return {cpu_time - before.cpu_time, waits - before.waits};
  }
};

/// Of one execution.
struct ExecutionTimes {
  TimePoint picked, start, end;
  bool are_read = false;  // otherwise all are the time of the pick
  ThreadUsage used = {};
};

/// Thread safety: as the sections say.
/// Real-time: the first section allocates nothing.
class Observation {
 public:
  /// `rule`: nullptr if there is none.
  Observation(const ExecutorOptions& options, const Rule* rule) : options_(options), rule_(rule) {}

  // ---- Workers ----

  bool records_times() const noexcept { return options_.statistics == StatisticsLevel::full; }
  /// Read before a traced execution begins and after it has ended, as that takes longer than many
  /// a callback.
  [[gnu::cold, gnu::noinline]] static ThreadUsage usage_of_thread() noexcept;
  /// With the dispatch lock held: the callback was picked, and has limits to keep.
  [[gnu::cold, gnu::noinline]] void watch_execution(CallbackRecord& record,
                                                    const Worker& worker) noexcept;
  /// Without it: evaluates the end of an execution by its deadline and budget, the next release,
  /// and its chains. Throws what the user's handlers throw.
  [[gnu::cold, gnu::noinline]] void check_limits(DispatchLock& dispatch_lock, const Worker& worker,
                                                 Execution& execution, const Dispatch& dispatch,
                                                 const ExecutionTimes& times);
  /// What waits for the rule to open may wait for ever, or does not.
  void set_closed(bool closed) noexcept { is_closed_.store(closed); }
  /// With the dispatch lock held.
  void record_times(CallbackRecord& record, const Slot& slot, const ExecutionTimes& times) noexcept;
  [[gnu::cold, gnu::noinline]] static void trace(Worker& worker, CallbackRecord& record,
                                                 const Slot& slot,
                                                 const ExecutionTimes& times) noexcept;

  // ---- Control threads, serialised by the mutex of the callbacks ----

  void release_timers(bool released) noexcept {
    timers_held_.store(released ? TimePoint{} : options_.clock->now());
  }
  /// How many are ready or running, and messages that wait for the end of a period.
  std::size_t pending(const CallbackRecords& records) const noexcept;
  /// Also of those that were removed.
  std::vector<CallbackStatistics> statistics(const CallbackRecords& records,
                                             const RemovedRecords& removed) const;
  /// It was removed.
  void remember(const CallbackRecord& record);
  /// Nothing is remembered any more.
  void end() noexcept { has_ended_ = true; }
  /// Of each worker since the last spin(); none before.
  std::vector<ThreadStatistics>& threads() noexcept { return threads_; }
  /// While no thread spins: the same, with traces, also where spin_some or the like ran the
  /// callbacks.
  std::vector<ThreadStatistics> thread_statistics(const CallbackRecords& records,
                                                  const Workers& workers) const;

  /// A deadline that has passed, and when the next one does.
  struct Miss {
    std::shared_ptr<Supervision> late;  // nullptr: there is none
    TimePoint missed = kNever, next = kNever;
  };
  /// Clears a deadline of the record that has passed. Returns true if it has a handler.
  static bool find_miss(const CallbackRecord& record, TimePoint now, Miss& miss) noexcept;
  /// On the watchdog's thread, without the mutex.
  static void report(const Miss& miss) noexcept;

 private:
  /// What a trace says of a callback.
  struct Traced {
    std::string name;
    EntityKind kind;
    std::uint64_t mark;
  };
  bool is_pending(const CallbackRecord& record) const noexcept;
  CallbackStatistics statistics_of(const CallbackRecord& record) const;
  static Traced traced(const CallbackRecord& record);

  const ExecutorOptions& options_;
  const Rule* const rule_;
  std::atomic<bool> is_closed_{false};    // by the rule, perhaps for ever
  std::atomic<TimePoint> timers_held_{};  // since when; {}: they are not
  std::vector<ThreadStatistics> threads_;
  PastStatistics past_;                  // of removed callbacks
  std::map<CallbackId, Traced> traced_;  // of these, too
  bool has_ended_ = false;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_
