// The engine of the named executors: readiness × scheduler × threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_

#include <atomic>
#include <memory>
#include <vector>

#include "takt/executors/engine/callbacks.hpp"
#include "takt/executors/engine/dispatcher.hpp"
#include "takt/executors/engine/observation.hpp"
#include "takt/executors/executor.hpp"

namespace takt {

/// The engine of the named executors: runs the callbacks of its nodes. This class only spins; its
/// parts do the rest:
/// 1. `Dispatcher::announce`: an entity announces itself to its record, on any thread: the record
///    goes into the ready set's inbox, and one sleeping worker is woken, if there is one.
/// 2. `Dispatcher::run_next`: a worker takes the dispatch lock (only where there is more than one
///    worker), picks a callback from the ready set, and executes it without the lock.
/// 3. `Workers::wait`: a worker that finds nothing to pick may search for a moment, then it sleeps.
///    One of the waiting workers wakes up for the first timer.
/// 4. `Callbacks`: a control thread builds a change as an update; a worker installs it at its next
///    dispatch. While no thread spins, the control thread installs it itself.
/// 5. `Observation`: counters, measured times, traces, and checks of deadlines.
/// Thread safety and real-time: as Executor.
class DispatchingExecutor final : public Executor {
 public:
  DispatchingExecutor(const ExecutorOptions& options, const ExecutorTraits& traits);

  void add_node(const std::shared_ptr<Node>& node) override { callbacks_.add_node(node); }
  void remove_node(const std::shared_ptr<Node>& node) override { callbacks_.remove_node(node); }
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node) override {
    callbacks_.add_callback_group(group, node);
  }
  void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                             const std::shared_ptr<Node>& node) override {
    callbacks_.remove_callback_group(group, node);
  }

  using Executor::spin;
  void spin(const ExceptionHandler& handler) override;
  void spin_once(Nanoseconds timeout) override;
  void spin_some(Nanoseconds max_duration) override { spin_some(max_duration, nullptr); }
  void spin_all(Nanoseconds max_duration) override;
  void cancel() noexcept override { workers().stop(); }
  bool is_spinning() const noexcept override { return has_workers_.load(); }
  void release_timers(bool released) noexcept override;
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override { return observation_.statistics(); }
  std::vector<ThreadStatistics> thread_statistics() const override {
    return observation_.thread_statistics(workers());
  }
  std::size_t thread_count() const override { return running_.size(); }
  std::vector<int> running_threads() const override;
  void begin_trace(std::size_t events) override { observation_.begin_trace(workers(), events); }
  void end_trace() noexcept override { observation_.end_trace(workers()); }
  std::vector<ThreadStatistics> traces() const override {
    return observation_.traces(workers(), running_);
  }

  // For executors that are made of others (isolated) and run them on one thread.

  /// Runs one callback if one is ready.
  bool run_one();
  /// As spin_some; `is_cancelled` (nullptr: none) ends it, too.
  void spin_some(Nanoseconds max_duration, const std::atomic<bool>* is_cancelled);
  /// A file descriptor for another wait back end, readable when a file descriptor of this executor
  /// is ready; -1: the executor has none. Call it only on the thread of the last spin, after that
  /// spin.
  int wait_fd() noexcept {
    detail::Places& places = workers().places();
    return places.watch_file_descriptors() ? places.backend_of(0).fd() : -1;
  }
  detail::Callbacks& callbacks() noexcept { return callbacks_; }
  detail::Workers& workers() noexcept { return dispatcher_.workers(); }
  const detail::Workers& workers() const noexcept { return dispatcher_.workers(); }

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  class Spin;

  TimePoint limit_of(Nanoseconds max_duration) const;
  void work(detail::Worker& worker);
  template <class Step>
  bool spin_here(Step&& step);

  const ExecutorOptions options_;
  const bool freezes_;
  const std::unique_ptr<Rule> rule_;
  const std::unique_ptr<WorkersPolicy> policy_;
  detail::CallbackLists lists_;
  detail::Observation observation_;
  detail::Dispatcher dispatcher_;
  detail::Callbacks callbacks_;
  std::atomic<bool> has_workers_{false};   // all threads of a spin exist
  std::vector<std::atomic<int>> running_;  // the kernel's number of each worker's thread; 0: none
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_
