// What an executor counts, measures, traces and checks of its callbacks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_
#define TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/workers.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/past_statistics.hpp"
#include "takt/executors/watchdog.hpp"

namespace takt::detail {

/// Thread safety: as the sections say.
/// Real-time: the first section allocates nothing.
class Observation final : private Watchdog::Watched {
 public:
  /// `rule`: nullptr if there is none. The lists outlive this.
  Observation(const ExecutorOptions& options, const Rule* rule, const CallbackLists& lists);
  ~Observation();
  Observation(const Observation&) = delete;
  Observation& operator=(const Observation&) = delete;

  // ---- Workers ----

  Watchdog* watchdog() const noexcept { return options_.watchdog.get(); }
  bool records_times() const noexcept { return options_.statistics == StatisticsLevel::full; }
  /// Whether the rule is closed, perhaps for ever: then ready callbacks are not pending.
  void set_closed(bool closed) noexcept { is_closed_.store(closed); }
  /// The statistics of each worker of the last spin(); none before. For the threads of the spin.
  std::vector<ThreadStatistics>& threads() noexcept { return threads_; }

  // ---- Any thread ----

  void release_timers(bool released) noexcept {
    timers_held_.store(released ? TimePoint{} : options_.clock->now());
  }
  /// How many callbacks are ready or running.
  std::size_t pending() const noexcept;
  /// Removed callbacks included.
  std::vector<CallbackStatistics> statistics() const;
  // As Executor. Traces include the executions of spin_some and its like.
  std::vector<ThreadStatistics> thread_statistics(const Workers& workers) const;
  void begin_trace(Workers& workers, std::size_t events);
  void end_trace(Workers& workers) noexcept;
  /// `threads`: the kernel's numbers, by worker; 0: it does not run.
  std::vector<ThreadStatistics> traces(const Workers& workers,
                                       const std::vector<std::atomic<int>>& threads) const;

  // ---- With the mutex of the lists ----

  /// Keeps the statistics of a removed callback, and its name for traces.
  void remember(const CallbackRecord& record) TAKT_REQUIRES(lists_.mutex);
  /// Later calls of `remember` do nothing.
  void end() noexcept TAKT_REQUIRES(lists_.mutex) { has_ended_ = true; }

 private:
  std::optional<TimePoint> report_miss(TimePoint now) noexcept override;
  bool is_pending(const CallbackRecord& record) const noexcept;
  CallbackStatistics statistics_of(const CallbackRecord& record) const;
  void add_trace(const Worker& worker, ThreadStatistics& to) const TAKT_REQUIRES(lists_.mutex);

  const ExecutorOptions& options_;
  const Rule* const rule_;
  const CallbackLists& lists_;
  std::atomic<bool> is_closed_{false};    // by the rule, perhaps for ever
  std::atomic<TimePoint> timers_held_{};  // since when; {}: they are not
  std::vector<ThreadStatistics> threads_;
  PastStatistics past_ TAKT_GUARDED_BY(lists_.mutex);  // of removed callbacks
  bool is_traced_ TAKT_GUARDED_BY(lists_.mutex);       // whether a trace was ever begun
  std::map<CallbackId, Traced> traced_ TAKT_GUARDED_BY(lists_.mutex);  // removed ones, for traces
  bool has_ended_ TAKT_GUARDED_BY(lists_.mutex) = false;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_OBSERVATION_HPP_
