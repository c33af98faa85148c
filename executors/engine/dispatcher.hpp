// The dispatch: a worker picks a callback, takes its input, executes it, and settles it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCHER_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCHER_HPP_

#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "takt/entities/staged_outputs.hpp"
#include "takt/executors/engine/dispatch_lock.hpp"
#include "takt/executors/engine/observation.hpp"
#include "takt/executors/engine/ready_set.hpp"
#include "takt/executors/engine/rule_step.hpp"
#include "takt/executors/engine/schedule_update.hpp"
#include "takt/executors/engine/workers.hpp"
#include "takt/executors/executor.hpp"

namespace takt::detail {

/// What the workers of an executor share, and what each of them does with it.
/// Thread safety: as the sections say; "with the lock": it is held before and after.
/// Real-time: nothing allocates, or blocks but for the lock.
class Dispatcher {
 public:
  /// `rule`, `policy`: nullptr, or those of the executor. They outlive the dispatcher.
  Dispatcher(const ExecutorOptions& options, Readiness readiness,
             const std::vector<ThreadAttributes>& threads, Rule* rule, const WorkersPolicy* policy,
             Observation& observation);

  DispatchLock& lock() noexcept TAKT_RETURNS_LOCK(workers_.lock()) { return workers_.lock(); }
  ReadySet& ready() noexcept { return ready_; }
  Updates& updates() noexcept { return updates_; }
  Workers& workers() noexcept { return workers_; }
  const Workers& workers() const noexcept { return workers_; }
  Observation& observation() noexcept { return observation_; }
  const Rule* rule() const noexcept { return rule_; }
  /// The last callback has run: with logical execution time, what waits is sent.
  void end(ThreadStatistics& statistics) noexcept {
    if (rule_step_) rule_step_->end(statistics);
  }
  /// Messages that wait for the end of a period.
  std::size_t held_back() const noexcept { return rule_step_ ? rule_step_->held_back() : 0; }

  // ---- Any thread ----

  /// The entity of the record has become ready.
  void announce(CallbackRecord& record, const Arrival& arrival) noexcept;
  /// Installs the updates of all executors whose callbacks this thread is in.
  static void install_updates_here() noexcept;

  // ---- The thread that spins, without the lock ----

  /// Before its first dispatch.
  void begin() noexcept;
  /// `handler`: nullptr if exceptions leave spin. It lives until the next call.
  void set_handler(const ExceptionHandler* handler) noexcept { handler_ = handler; }
  /// What a callback has thrown, once; then no thread of the executor runs.
  void rethrow();

  /// Installs an update, if there is one. Where no worker does: no thread spins.
  void install_here() noexcept {
    const std::lock_guard guard(lock());
    install_update();
  }

  // ---- Workers, with the lock ----

  void install_update() noexcept TAKT_REQUIRES(workers_.lock()) {
    if (updates_.is_pending(std::memory_order_relaxed)) [[unlikely]]
      install_pending_update();
  }
  void take_snapshot() noexcept TAKT_REQUIRES(workers_.lock()) {
    rule_step_ ? rule_step_->take_snapshot() : ready_.take_snapshot();
  }
  /// Returns false if there was nothing to run.
  bool run_next(Worker& worker, const ReadySet::Limits& limits) noexcept
      TAKT_REQUIRES(workers_.lock());
  /// The same where no rule decides, or has decided.
  bool run_ready(Worker& worker, const ReadySet::Limits& limits) noexcept
      TAKT_REQUIRES(workers_.lock());
  /// Runs what has begun, and whose input is taken. `outputs`: where its messages wait.
  void execute(Worker& worker, Execution& execution, StagedOutputs* outputs) noexcept
      TAKT_REQUIRES(workers_.lock());
  /// As Workers::wait.
  bool wait(Worker& worker, TimePoint limit, const FutureState* future = nullptr) noexcept
      TAKT_REQUIRES(workers_.lock()) {
    has_just_run_ = false;
    return workers_.wait(worker, limit, future);
  }

 private:
  /// A callback so brief leaves the dispatch in the caches, which then takes as long as a reading
  /// of the clock.
  static constexpr Nanoseconds kBrief{500};

  [[gnu::cold, gnu::noinline]] void install_pending_update() noexcept
      TAKT_REQUIRES(workers_.lock());
  void take(Execution& execution) noexcept TAKT_REQUIRES(workers_.lock());
  ExecutionTimes run(Worker& worker, Execution& execution, TimePoint picked,
                     StagedOutputs* outputs) noexcept;
  void call(Execution& execution) noexcept;
  bool starts_at_once(const ExecutionTimes& times, const Execution& execution) const noexcept;
  void finish(Worker& worker, Execution& execution, ExecutionTimes& times) noexcept
      TAKT_REQUIRES(workers_.lock());
  [[gnu::cold, gnu::noinline]] void discard(Execution& execution, Counter<>& counted) noexcept;
  [[gnu::cold, gnu::noinline]] void caught(const CallbackRecord& record,
                                           std::exception_ptr exception) noexcept;

  const ExecutorOptions& options_;
  Rule* const rule_;
  Observation& observation_;
  ExecutionModel* const model_;
  const bool counts_allocations_;
  const bool times_take_;      // the callback's start is read, as it is later than the pick
  bool has_just_run_ = false;  // on an only worker: a brief callback, and nothing else since
  ReadySet ready_;
  std::optional<RuleStep> rule_step_;
  Updates updates_;
  const ExceptionHandler* handler_ = nullptr;
  std::exception_ptr exception_ TAKT_GUARDED_BY(workers_.lock());
  Workers workers_;
};

inline bool Worker::is_only_one_of(const Dispatcher& dispatcher) noexcept {
  return current_ != nullptr && current_->dispatcher == &dispatcher &&
         !dispatcher.workers().lock().is_shared();
}

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCHER_HPP_
