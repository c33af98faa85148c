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

/// Everything that Takt's engine does around a callback except choosing it, for executors without
/// the engine (TAKT_REGISTER_EXECUTOR_CLASS): so they have the same results, chains, deadlines,
/// budgets, timelines and threads. Readiness, order, waiting, groups and removals remain the
/// executor's own. The executor makes one observer, and:
/// - calls add() when an entity gets its sink, and remove() when that is detached;
/// - makes a Thread for as long as a thread spins, and calls its run() for each execution;
/// - forwards the calls of its own methods that have the names of those below.
///
/// Thread safety: every method from any thread; a Thread belongs to the thread that made it.
/// Real-time: Thread::run allocates nothing; it takes a lock with priority inheritance, which is
/// held for less than a microsecond. All else is for the set-up.
class CallbackObserver {
 public:
  /// A callback of the executor. It lives until remove().
  class Callback;

  /// `threads`: how many there are, if the options name none.
  explicit CallbackObserver(const ExecutorOptions& options, std::size_t threads = 1);
  /// Call it when there is no Thread any more.
  ~CallbackObserver();
  CallbackObserver(const CallbackObserver&) = delete;
  CallbackObserver& operator=(const CallbackObserver&) = delete;

  Callback& add(const std::shared_ptr<Entity>& entity, const Node& node);
  /// Call it when no thread runs the callback any more and nothing announces it. Its counts stay.
  void remove(Callback& callback) noexcept;

  static Entity& entity(const Callback& callback) noexcept;
  /// The callback's priority, deadline, budget and whatever else an order uses. `id` counts from 0.
  CallbackInfo info(const Callback& callback) const;
  /// Whether all other callbacks come first now: this one was too long or too late
  /// (OverrunPolicy::demote), or a mode has demoted or dropped it.
  bool is_demoted(const Callback& callback) const;

  // As Executor and NodeListener.

  void parameters_changed(Node& node);
  /// For the count of missed releases. It is up to the executor not to run timers that are held.
  void release_timers(bool released) noexcept;
  /// How many callbacks have messages, or run.
  std::size_t pending() const noexcept;
  std::vector<CallbackStatistics> statistics() const;
  /// For each index, of the Thread that was destroyed last.
  std::vector<ThreadStatistics> thread_statistics() const;
  /// The kernel's numbers of the Threads that exist.
  std::vector<int> running_threads() const;
  void begin_trace(std::size_t events);
  void end_trace() noexcept;
  std::vector<ThreadStatistics> traces() const;

  /// A thread that runs callbacks.
  class Thread {
   public:
    /// Gives the calling thread the attributes of ExecutorOptions::threads at the index. Throws
    /// Error if there is no such thread, or if attributes are refused that are required.
    explicit Thread(CallbackObserver& observer, std::size_t index = 0);
    ~Thread();
    Thread(const Thread&) = delete;
    Thread& operator=(const Thread&) = delete;

    /// Takes the entity's input, and runs the callback. False: there was no input. Throws what the
    /// callback, or a handler of its limits, throws; that execution is counted. Two threads run one
    /// callback at the same time only if its group is reentrant. A deadline that has passed before
    /// is reported here; one that passes while it runs, by the watchdog if there is one.
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
