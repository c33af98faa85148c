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

/// The state that the workers of an executor share, and the steps of one dispatch.
/// Thread safety: as the sections say; "with the lock": the caller holds the dispatch lock, and
/// holds it again when the function returns.
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
  /// Called after the last callback. With logical execution time, sends the staged outputs.
  void end(ThreadStatistics& statistics) noexcept {
    if (rule_step_) rule_step_->end(statistics);
  }
  /// How many staged outputs wait for the end of a period.
  std::size_t held_back() const noexcept { return rule_step_ ? rule_step_->held_back() : 0; }

  // ---- Any thread ----

  /// The entity of the record has become ready.
  void announce(CallbackRecord& record, const Arrival& arrival) noexcept;
  /// Installs the pending updates of every executor whose callback this thread is in (nested
  /// spins).
  static void install_updates_here() noexcept;

  // ---- The thread that spins, without the lock ----

  /// Called before the first dispatch of a spin.
  void begin() noexcept;
  /// `handler`: nullptr: exceptions leave spin. The handler must live until the next call.
  void set_handler(const ExceptionHandler* handler) noexcept { handler_ = handler; }
  /// Rethrows the exception of a callback, if there is one, once. Call it when no worker runs.
  void rethrow();

  /// Installs the pending update, if any, on the calling thread: for when no worker would do so
  /// soon (no thread spins, or this worker waits inside a callback).
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
  /// The same where there is no rule, or where the rule has looked and is open.
  bool run_ready(Worker& worker, const ReadySet::Limits& limits) noexcept
      TAKT_REQUIRES(workers_.lock());
  /// Runs an execution that has begun and has its input. `outputs`: stages what the callback
  /// publishes; nullptr: it is sent at once.
  void execute(Worker& worker, Execution& execution, StagedOutputs* outputs) noexcept
      TAKT_REQUIRES(workers_.lock());
  /// As Workers::wait.
  bool wait(Worker& worker, TimePoint limit, const FutureState* future = nullptr) noexcept
      TAKT_REQUIRES(workers_.lock()) {
    has_just_run_ = false;
    return workers_.wait(worker, limit, future);
  }

 private:
  /// After a callback this brief the dispatch code is still in the caches, and a dispatch takes no
  /// longer than a clock reading.
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
  const bool times_take_;      // the clock is read again after the take, which may be long
  bool has_just_run_ = false;  // with one worker: its last step was a brief callback
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
