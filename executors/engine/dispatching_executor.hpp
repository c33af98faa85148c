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

/// Runs the callbacks of its nodes: the engine of the named executors. It spins; all else is done
/// by its parts.
/// 1. `Dispatcher::announce`: an entity announces itself to its record, on whatever thread: the
///    record goes into the ready set's inbox, and one sleeping worker is woken, if there is one.
/// 2. `Dispatcher::run_next`: a worker takes the dispatch lock (only where there is more than one
///    worker), picks a callback from the ready set, and executes it without the lock.
/// 3. `Workers::wait`: when there is nothing to pick, the worker waits: it may search for a moment,
///    then it sleeps. One of those that wait does so until the first timer is due.
/// 4. `Callbacks`: a control thread builds a change as an update; a worker installs it at its next
///    dispatch. While no thread spins, the control thread installs it itself.
/// 5. `Observation`: what is counted, measured and checked.
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
  std::size_t pending() const noexcept override { return callbacks_.pending(); }
  std::vector<CallbackStatistics> statistics() const override { return callbacks_.statistics(); }
  std::vector<ThreadStatistics> thread_statistics() const override {
    return callbacks_.thread_statistics();
  }
  std::size_t thread_count() const override { return running_.size(); }
  std::vector<int> running_threads() const override;
  void begin_trace(std::size_t events) override { callbacks_.begin_trace(events); }
  void end_trace() noexcept override { callbacks_.end_trace(); }
  std::vector<ThreadStatistics> traces() const override { return callbacks_.traces(running_); }

  // For executors that are made of others (isolated) and run them on one thread.

  /// Runs one callback if one is ready.
  bool run_one();
  /// As spin_some; `is_cancelled` (nullptr: none) ends it, too.
  void spin_some(Nanoseconds max_duration, const std::atomic<bool>* is_cancelled);
  /// As remove_callback_group, for all of these groups that belong to this executor.
  void release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups, Node& node) noexcept {
    callbacks_.release_groups(std::move(groups), node);
  }
  /// Nothing of the node belongs to it, and nothing will: it does not even make a pointer to it any
  /// more, which might be the last one for a moment.
  void forget(Node& node) noexcept { callbacks_.forget(node); }
  /// Whether it has callbacks, or the node or one of its groups belongs to it. Callbacks may live
  /// longer than their node: then `node` is nullptr.
  bool is_used_by(const Node* node) const { return callbacks_.is_used_by(node); }
  /// Discards a cancel that arrived after the end of spin.
  void forget_cancel() noexcept { workers().take_stop(); }
  /// When the first timer is due. Call it only while no thread spins; other threads may remove
  /// timers meanwhile.
  TimePoint next_release() const noexcept { return callbacks_.next_release(); }
  /// A descriptor for another wait back end, ready when a file descriptor of this executor is; -1
  /// if it has none. Call it only on the thread of the last spin, after that spin.
  int wait_fd() noexcept {
    detail::Places& places = workers().places();
    return places.watch_file_descriptors() ? places.backend_of(0).fd() : -1;
  }
  /// The observer is woken when a callback becomes ready and no worker sleeps.
  void set_observer(Wakeable* observer) noexcept { workers().set_observer(observer); }

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  class Spin;

  detail::Workers& workers() noexcept { return dispatcher_.workers(); }
  TimePoint limit_of(Nanoseconds max_duration) const;
  void work(detail::Worker& worker);
  template <class Step>
  bool spin_here(Step&& step);

  const ExecutorOptions options_;
  const bool freezes_;
  const std::unique_ptr<Rule> rule_;
  const std::unique_ptr<WorkersPolicy> policy_;
  detail::Observation observation_;
  detail::Dispatcher dispatcher_;
  detail::Callbacks callbacks_;
  std::atomic<bool> has_workers_{false};   // all threads of a spin exist
  std::vector<std::atomic<int>> running_;  // the kernel's number of each worker's thread; 0: none
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_
