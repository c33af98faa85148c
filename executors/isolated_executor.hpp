// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "takt/executors/executor.hpp"
#include "takt/executors/single_threaded_executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// One single-threaded executor, and one thread, for each node (rclcpp's
/// component_container_isolated) or, with Isolation::group, for each callback group that has
/// callbacks: none delays another but by the CPU. Children take the options' threads in order, then
/// cyclically, each named after its node and group; the thread that calls spin only waits for the
/// end. spin_some, spin_all, spin_once and spin_until_future_complete run the children one after
/// another on the caller.
///
/// A group's parameters, as they are when its child is made, are its thread's: its priority that of
/// a SCHED_FIFO or SCHED_RR thread, its budget, deadline and period those of a SCHED_DEADLINE
/// thread. So threads preempt each other as the callbacks' parameters say: fixed priority, or EDF.
/// A reentrant group has one thread all the same.
/// Thread safety and real-time: as Executor. Adding a node or a group while it spins starts a
/// thread.
class IsolatedExecutor final : public Executor, private NodeListener, private Wakeable {
 public:
  explicit IsolatedExecutor(const ExecutorOptions& options = {});
  ~IsolatedExecutor() override;

  void add_node(const std::shared_ptr<Node>& node) override;
  void remove_node(const std::shared_ptr<Node>& node) override;
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node) override;
  void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                             const std::shared_ptr<Node>& node) override;
  using Executor::spin;
  void spin(const ExceptionHandler& handler) override;
  void spin_once(Nanoseconds timeout) override;
  void spin_some(Nanoseconds max_duration) override;
  void spin_all(Nanoseconds max_duration) override;
  void cancel() noexcept override;
  bool is_spinning() const noexcept override;
  std::size_t max_threads() const noexcept override { return SIZE_MAX; }
  void release_timers(bool released) noexcept override;
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override;
  std::vector<ThreadStatistics> thread_statistics() const override;

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  /// While children run on the caller, the caller's wait back end watches those of the children.
  struct Waker final : ArrivalListener {
    explicit Waker(IsolatedExecutor& to_wake) : parent(to_wake) {}
    void announce(Arrival) noexcept override { parent.wake(); }
    IsolatedExecutor& parent;
  };
  struct Child {
    Child(IsolatedExecutor& parent, const ExecutorOptions& options,
          const std::shared_ptr<Node>& for_node, const std::shared_ptr<CallbackGroup>& for_group)
        : node(for_node), group(for_group), executor(options), waker(parent) {}
    std::weak_ptr<Node> node;
    std::weak_ptr<CallbackGroup> group;  // empty: of the whole node
    SingleThreadedExecutor executor;
    Waker waker;
    std::atomic<std::thread::id> runs_on{};
    std::mutex joining;  // taken before the executor's mutex_; guards thread
    std::thread thread;
    // Guarded by the executor's mutex_. Who removes what the child has keeps the child when
    // somebody adds something to it, or has done so meanwhile.
    int adding = 0;
    std::uint64_t added = 0;
    bool is_gone = false;
  };
  class Spin;

  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node&, const std::shared_ptr<CallbackGroup>&) override {}
  void parameters_changed(Node&) override {}
  bool is_per_group() const noexcept { return options_.per == Isolation::group; }
  [[noreturn]] void refuse_stranger(const Node& node) const;
  std::shared_ptr<Child> find(const Node& node, const CallbackGroup* group) const;
  std::shared_ptr<Child> find_child(const Node& node, const CallbackGroup* group) const;
  template <class Add>
  void add(const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group,
           Add&& to_child);
  std::uint64_t added(const Child& child) const noexcept;
  void remove(const std::shared_ptr<Child>& child, std::uint64_t added_before) noexcept;
  std::vector<std::shared_ptr<Child>> children() const;
  void start(Child& child);
  void run_in_thread(Child& child);
  static void stop(Child& child) noexcept;
  static void join(Child& child) noexcept;
  bool run_one();
  template <class Done>
  void run_on_caller(TimePoint limit, bool once, Done&& done);
  void wake() noexcept override;

  const ExecutorOptions options_;
  const std::unique_ptr<WaitBackend> backend_;
  std::atomic<bool> spinning_{false}, cancelled_{false}, has_news_{false};
  std::size_t next_turn_ = 0;  // of the children, on the caller's thread

  mutable std::mutex mutex_;  // guards all below; control threads only
  std::vector<std::shared_ptr<Child>> children_;
  std::vector<std::weak_ptr<Node>> nodes_;  // with a thread for each group: those we listen to
  PastStatistics past_;                     // of the children that were removed
  std::vector<ThreadStatistics>
      past_threads_;            // one for each name, as many as PastStatistics keeps
  bool runs_children_ = false;  // each on its thread
  bool releases_timers_ = true;
  ExceptionHandler handler_;
  std::exception_ptr exception_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
