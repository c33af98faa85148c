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

/// Thread safety: as the sections say.
/// Real-time: the first section allocates nothing.
class Observation {
 public:
  /// `rule`: nullptr if there is none.
  Observation(const ExecutorOptions& options, const Rule* rule)
      : options_(options), rule_(rule), is_traced_(options.trace_events != 0) {}

  // ---- Workers ----

  Watchdog* watchdog() const noexcept { return options_.watchdog.get(); }
  bool records_times() const noexcept { return options_.statistics == StatisticsLevel::full; }
  /// What waits for the rule to open may wait for ever, or does not.
  void set_closed(bool closed) noexcept { is_closed_.store(closed); }

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
  /// As Executor.
  void begin_trace(const CallbackRecords& records, Workers& workers, std::size_t events);
  /// Of each worker, without its thread.
  std::vector<ThreadStatistics> traces(const CallbackRecords& records,
                                       const Workers& workers) const;

 private:
  bool is_pending(const CallbackRecord& record) const noexcept;
  CallbackStatistics statistics_of(const CallbackRecord& record) const;

  const ExecutorOptions& options_;
  const Rule* const rule_;
  std::atomic<bool> is_closed_{false};    // by the rule, perhaps for ever
  std::atomic<TimePoint> timers_held_{};  // since when; {}: they are not
  std::vector<ThreadStatistics> threads_;
  PastStatistics past_;                  // of removed callbacks
  bool is_traced_;                       // or was
  std::map<CallbackId, Traced> traced_;  // of these, too
  bool has_ended_ = false;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_
