// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/executors/wait_backends/sleepers.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// Applies the parameters of a group to the thread that this group alone has, see IsolatedExecutor.
void apply_parameters(const CallbackParameters& parameters, ThreadAttributes& thread);

/// One single-threaded executor, and one thread, for each node (rclcpp's
/// component_container_isolated) or, with Isolation::group, for each callback group that has
/// callbacks: none delays another but by sharing a CPU. Children take the options' threads in
/// order, then cyclically, each named after its node and group; one that is made later takes the
/// place of one that has gone. The thread that calls spin only waits for the end. spin_some,
/// spin_all, spin_once and spin_until_future_complete run the children one after another on the
/// caller.
///
/// A child's thread has the parameters that its group has when the child is made: the priority, if
/// it is a SCHED_FIFO or SCHED_RR thread; the budget, deadline and period, if it is a
/// SCHED_DEADLINE thread. So threads preempt each other as the callbacks' parameters say: fixed
/// priority, or EDF.
/// A reentrant group has ExecutorOptions::reentrant_threads such threads for its callbacks.
/// Thread safety and real-time: as Executor. Adding a node or a group while it spins starts a
/// thread. That thread ends when nothing belongs to it any more: at once, or soon, if a callback
/// has removed the last part. A node or group that was dropped without having been removed ends its
/// thread when something else is added.
class IsolatedExecutor final : public Executor, private NodeListener, private Wakeable {
 public:
  IsolatedExecutor(const ExecutorOptions& options, const ExecutorTraits& traits);
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
  void release_timers(bool released) noexcept override;
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override;
  std::vector<ThreadStatistics> thread_statistics() const override;
  std::size_t thread_count() const override;
  std::vector<int> running_threads() const override;
  void begin_trace(std::size_t events) override;
  void end_trace() noexcept override;
  std::vector<ThreadStatistics> traces() const override;

  /// The thread of a child: its index among the options' threads, cyclically, and its attributes.
  struct ChildThread {
    std::size_t place;
    ThreadAttributes attributes;
  };
  /// The unit that has a child of its own: the group, or nullptr for the node as a whole.
  const CallbackGroup* unit_of(const CallbackGroup& group) const noexcept {
    return is_per_group() ? &group : nullptr;
  }
  /// The thread of the child that has the group; if there is none, the one that it would get when
  /// `after` other children have been made.
  ChildThread thread_of(const std::shared_ptr<Node>& node,
                        const std::shared_ptr<CallbackGroup>& group, std::size_t after = 0) const;

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  /// While children run on the caller, the caller's wait back end watches those of the children.
  struct Waker final : ArrivalListener {
    explicit Waker(IsolatedExecutor& to_wake) : parent(to_wake) {}
    void announce(const Arrival&) noexcept override { parent.wake(); }
    IsolatedExecutor& parent;
  };
  struct Child {
    Child(IsolatedExecutor& parent, const ExecutorOptions& options,
          const std::shared_ptr<Node>& for_node, const std::shared_ptr<CallbackGroup>& for_group,
          std::size_t at)
        : node(for_node),
          group(for_group),
          place(at),
          attributes(options.threads.front()),
          executor(options, parent.traits_),
          waker(parent) {}
    std::weak_ptr<Node> node;
    std::weak_ptr<CallbackGroup> group;  // empty: of the whole node
    const std::size_t place;             // among the threads of the options
    const ThreadAttributes attributes;
    DispatchingExecutor executor;
    Waker waker;
    std::atomic<bool> runs{false};  // on its thread
    // Guarded by the executor's mutex_.
    std::thread thread;
    int adding = 0;         // threads that add something to it
    bool may_spin = false;  // it has what it was made for, so its first spin knows what to wait for
    std::atomic<bool> is_joined{false};  // a thread joins its thread; written under the mutex
    bool may_go = false;  // a callback has removed what it had; the spinning thread removes it
    bool is_gone = false;
  };
  class Spin;
  using Mutex = RankedMutex<LockRank::isolated>;
  using Lock = std::unique_lock<Mutex>;

  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node&, const std::shared_ptr<CallbackGroup>&) override {}
  void parameters_changed(Node&) override {}
  bool is_per_group() const noexcept { return options_.per == Isolation::group; }
  [[noreturn]] void refuse_stranger(const Node& node) const;
  std::shared_ptr<Child> find(const std::shared_ptr<Node>& node,
                              const std::shared_ptr<CallbackGroup>& group) const;
  std::shared_ptr<Child> find_child(const std::shared_ptr<Node>& node,
                                    const std::shared_ptr<CallbackGroup>& group) const;
  ChildThread next_thread(std::size_t after, const CallbackGroup* group) const;
  std::shared_ptr<Child> make_child(const std::shared_ptr<Node>& node,
                                    const std::shared_ptr<CallbackGroup>& group);
  template <class Add>
  void add(const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group,
           Add&& to_child);
  std::vector<std::shared_ptr<Child>> children() const;
  std::vector<std::shared_ptr<Child>> children_to_spin() const;
  static bool is_used(Child& child, const Node* node);
  void remove_unless_used(const std::shared_ptr<Child>& child);
  void remove_forgotten();
  void finish_removals();
  void end(const std::shared_ptr<Child>& child, Node* node, Lock& lock);
  void join(Child& child, Lock& lock);
  void start(Child& child);
  void run(Child& child, const ExceptionHandler& handler) noexcept;
  void end_children() noexcept;
  bool run_one();
  template <class Done>
  void run_on_caller(TimePoint limit, bool once, Done&& done);
  bool is_over(TimePoint limit) const noexcept {
    return limit != kNever && options_.clock->now() >= limit;
  }
  void wake() noexcept override;
  /// Returns true if it was woken.
  bool sleep(TimePoint deadline) noexcept;

  const ExecutorOptions options_;
  const ExecutorTraits traits_;  // of the children too
  const std::unique_ptr<WaitBackend> backend_;
  detail::Sleepers sleeper_;  // the thread that spins
  std::atomic<bool> spinning_{false}, cancelled_{false};
  std::size_t next_turn_ = 0;  // of the children, on the caller's thread

  mutable Mutex mutex_;  // guards all below
  std::vector<std::shared_ptr<Child>> children_;
  std::vector<std::weak_ptr<Node>> nodes_;  // with a thread for each group: the nodes it listens to
  // Of the children that were removed.
  detail::PastStatistics past_;
  detail::PastThreads past_threads_{options_.trace_events};
  std::optional<detail::PastThreads> past_traces_;  // since the last begin_trace()
  std::size_t traced_events_ = 0;                   // of each child, from begin to end of a trace
  bool releases_timers_ = true;
  const ExceptionHandler* handler_ = nullptr;  // of the spin that runs children on their threads
  std::exception_ptr exception_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
