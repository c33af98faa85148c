// Statistics, chains, limits and timelines for an executor that is a class of its own.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_CALLBACK_OBSERVER_HPP_
#define TAKT_EXECUTORS_CALLBACK_OBSERVER_HPP_

#include <cstddef>
#include <memory>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// What Takt's engine does around each callback, but for choosing it: for executors without the
/// engine (TAKT_REGISTER_EXECUTOR_CLASS), whose results, chains, deadlines, budgets, timelines and
/// threads are then those of any other. When an entity is ready, which runs next, how threads wait,
/// groups and removals stay the executor's. It makes one, and:
/// - add(), when the entity gets its sink, and remove(), when that is detached;
/// - a Thread, for as long as a thread spins, and its run() for each execution;
/// - passes on what the methods of the same names are asked.
///
/// Thread safety: every method from any thread; a Thread belongs to the thread that made it.
/// Real-time: Thread::run allocates nothing; it takes a lock with priority inheritance, which is
/// held for less than a microsecond. All else is for the set-up.
class CallbackObserver {
 public:
  /// One of the executor's. It lives until remove().
  class Callback;

  /// For the threads of the options or, if they name none, for so many.
  explicit CallbackObserver(const ExecutorOptions& options, std::size_t threads = 1);
  /// There is no Thread any more.
  ~CallbackObserver();
  CallbackObserver(const CallbackObserver&) = delete;
  CallbackObserver& operator=(const CallbackObserver&) = delete;

  Callback& add(const std::shared_ptr<Entity>& entity, const Node& node);
  /// No thread runs it any more, and nothing announces it. What was counted stays.
  void remove(Callback& callback) noexcept;

  static Entity& entity(const Callback& callback) noexcept;
  /// Its priority, deadline, budget and what else an order goes by. `id` counts from 0.
  CallbackInfo info(const Callback& callback) const;
  /// All others come first now: it was too long or too late (OverrunPolicy::demote), or a mode has
  /// demoted or dropped it.
  bool is_demoted(const Callback& callback) const;

  // As Executor and NodeListener.

  void parameters_changed(Node& node);
  /// Counts what is held; not to run what is held is the executor's.
  void release_timers(bool released) noexcept;
  /// How many have messages, or run.
  std::size_t pending() const noexcept;
  std::vector<CallbackStatistics> statistics() const;
  /// Of the Threads that were destroyed last.
  std::vector<ThreadStatistics> thread_statistics() const;
  /// The kernel's numbers of the Threads that there are.
  std::vector<int> running_threads() const;
  void begin_trace(std::size_t events);
  void end_trace() noexcept;
  std::vector<ThreadStatistics> traces() const;

  /// A thread that runs callbacks.
  class Thread {
   public:
    /// The calling thread is that of ExecutorOptions::threads at the index, whose attributes it
    /// gets. Throws Error if there is no such thread, or if these are refused, and required.
    explicit Thread(CallbackObserver& observer, std::size_t index = 0);
    ~Thread();
    Thread(const Thread&) = delete;
    Thread& operator=(const Thread&) = delete;

    /// Takes what the entity has, and runs the callback. False: there was nothing to take. Throws
    /// what the callback, or a handler of its limits, throws; that execution is counted. Two
    /// threads run one callback at the same time only if its group is reentrant. A deadline that
    /// has passed before is reported here; one that passes while it runs, by the watchdog if
    /// there is one.
    bool run(Callback& callback);

   private:
    struct State;
    const std::unique_ptr<State> state_;
  };

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_CALLBACK_OBSERVER_HPP_
