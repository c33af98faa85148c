// LifecycleNode: a node with states, which other nodes configure, activate and shut down.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_LIFECYCLE_NODE_HPP_
#define TAKT_NODES_LIFECYCLE_NODE_HPP_

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/entities/callback_list.hpp"
#include "takt/nodes/callback_gate.hpp"
#include "takt/nodes/lifecycle_publisher.hpp"
#include "takt/nodes/lifecycle_state_machine.hpp"
#include "takt/nodes/managed_entities.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// The result of a request. True: the callback returned SUCCESS.
struct TransitionResult {
  /// What the transition's callback returned; nothing: the request was rejected without any
  /// effect.
  std::optional<CallbackReturn> returned;
  LifecycleState state = LifecycleState::unknown;  // of the node afterwards
  std::string message;  // refused or without success: why, and what can be asked for

  explicit operator bool() const noexcept { return returned == CallbackReturn::SUCCESS; }
};

/// ROS 2's managed node (design.ros2.org/articles/node_lifecycle.html). A request runs one of the
/// callbacks below, on the calling thread; its return value decides the next state.
///
/// Inactive means inactive, as the design says (in rclcpp only publishers are managed: #1846). The
/// publishers, subscriptions and timers that this class creates work in the state `active` only:
/// - in other states, publishing has no effect, see LifecyclePublisher;
/// - messages that arrive in other states wait, up to the depth, until the node is active again; no
///   thread is woken for them;
/// - timers are paused in other states. Their phase begins when the node becomes active, even if it
///   does so because on_deactivate returned FAILURE. A cancelled timer stays cancelled.
/// Before on_deactivate, or on_shutdown of an active node, is called, the running managed callbacks
/// have returned; no further one begins. A request from one of them does not wait for that one.
/// (Two nodes whose managed callbacks deactivate each other at the same time wait for ever.) With
/// logical execution time, callbacks of the same period that have not begun are skipped: their
/// inputs are lost.
/// Services, clients, guard conditions and file descriptors always work. To create other entities
/// that always work, call `Node::create_timer(…)` and so on.
///
/// Thread safety: every method from any thread. Requests do not wait for each other: one
/// that comes during another, from any thread or callback, is rejected.
/// Real-time: requests block, allocate and run the user's code: for control threads. A managed
/// callback costs three more atomic additions than others, and nothing allocates.
/// Errors: exceptions from callbacks are logged and count as ERROR. The result of a
/// rejected request says why; nothing throws.
class LifecycleNode : public Node {
 public:
  using SharedPtr = std::shared_ptr<LifecycleNode>;
  using CallbackReturn = takt::CallbackReturn;

  explicit LifecycleNode(std::string_view name, const NodeOptions& options = {});

  /// In the state `unconfigured` → `inactive`.
  TransitionResult configure() { return trigger_transition("configure"); }
  /// `inactive` → `unconfigured`.
  TransitionResult cleanup() { return trigger_transition("cleanup"); }
  /// `inactive` → `active`.
  TransitionResult activate() { return trigger_transition("activate"); }
  /// `active` → `inactive`.
  TransitionResult deactivate() { return trigger_transition("deactivate"); }
  /// `unconfigured`, `inactive`, `active` → `finalized`.
  TransitionResult shutdown() { return trigger_transition("shutdown"); }
  TransitionResult trigger_transition(std::string_view label);
  TransitionResult trigger_transition(TransitionId id);

  /// Leads the node to `finalized`, as a manager does at the end: deactivate, cleanup, shutdown; or
  /// shutdown at once where one of these fails. Waits for the transition of another thread.
  void bring_down();

  /// During a transition: its transition state.
  LifecycleState get_current_state() const noexcept { return state_.load(); }
  /// How often it has left the state `active`, and its callbacks have come to rest.
  std::uint32_t deactivations() const noexcept { return gate_->closings() - 1; }

  // Managed entities, as Node's.

  [[nodiscard]] std::shared_ptr<Timer> create_timer(
      std::string name, Nanoseconds period, std::function<void()> callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    return make_timer(clock(), std::move(name), period, std::move(callback), std::move(group));
  }
  template <TaskCallback F>
  [[nodiscard]] std::shared_ptr<Timer> create_timer(
      std::string name, Nanoseconds period, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    return make_timer(clock(), std::move(name), period, std::move(callback), std::move(group));
  }
  template <class F>
  [[nodiscard]] std::shared_ptr<Timer> create_wall_timer(
      Nanoseconds period, F callback, std::shared_ptr<CallbackGroup> group = nullptr) {
    return make_timer(clock().real(), next_wall_timer_name(), period, std::move(callback),
                      std::move(group));
  }

  template <Message T>
  [[nodiscard]] std::shared_ptr<LifecyclePublisher<T>> create_publisher(
      std::string_view topic, const QoS& qos, const PublisherOptions<T>& options = {}) {
    return std::make_shared<LifecyclePublisher<T>>(
        gate_,
        publisher_endpoint(topic, message_type<T>(), qos, options.loans,
                           {options.published_by, options.joins}, options.graph_node),
        clock().real(), options, participant());
  }

  template <Message T, SubscriptionCallback<T> F>
  [[nodiscard]] std::shared_ptr<Subscription<T>> create_subscription(
      std::string_view topic, const QoS& qos, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    group = group_or_default(std::move(group));
    auto subscription = std::make_shared<ManagedSubscription<T, F>>(
        gate_, clock().real(), std::string(topic), group, endpoint<T>(topic, qos),
        std::move(callback), participant());
    if constexpr (CallbackSubscription<T, F>::kIsTask) {
      subscription->set_runner(managed_task_runner(std::string(topic), group));
    }
    manage(subscription);
    auto handle = adopt<Subscription<T>>(subscription);
    subscription->start();
    return handle;
  }

  // For LifecycleServices.

  using TransitionListener = std::function<void(const LifecycleTransition&)>;
  /// Called with each row of the table that the node has gone through, on the thread of the
  /// request. Empty: none. When this returns, the previous listener is not called any more, but
  /// for a call that it is made in, or that waits for the caller.
  void set_transition_listener(TransitionListener listener);

 protected:
  // `previous` is the state in which the request came: for on_error too.

  virtual CallbackReturn on_configure(LifecycleState previous);
  virtual CallbackReturn on_cleanup(LifecycleState previous);
  virtual CallbackReturn on_activate(LifecycleState previous);
  virtual CallbackReturn on_deactivate(LifecycleState previous);
  /// The node is finalized even if this returns FAILURE.
  virtual CallbackReturn on_shutdown(LifecycleState previous);
  /// After an ERROR. SUCCESS: the node is unconfigured again. Otherwise, and unless it is
  /// overridden, the node is finalized.
  virtual CallbackReturn on_error(LifecycleState previous);

 private:
  std::shared_ptr<Timer> make_timer(Clock& clock, std::string name, Nanoseconds period,
                                    std::function<void()> callback,
                                    std::shared_ptr<CallbackGroup> group);
  template <TaskCallback F>
  std::shared_ptr<Timer> make_timer(Clock& clock, std::string name, Nanoseconds period, F callback,
                                    std::shared_ptr<CallbackGroup> group) {
    group = group_or_default(std::move(group));
    auto runner = managed_task_runner(name, group);
    auto timer =
        std::make_shared<ManagedTimer<TaskTimer>>(gate_, std::move(name), std::move(group), clock,
                                                  period, std::move(callback), std::move(runner));
    manage(timer);
    return adopt_timer(timer);
  }
  template <class Request>
  TransitionResult request(Request which, const std::string& name);
  CallbackReturn go_through(const LifecycleTransition& transition);
  void step(const LifecycleTransition& transition);
  CallbackReturn call(LifecycleState during, LifecycleState previous) noexcept;
  CallbackReturn call_unguarded(LifecycleState during, LifecycleState previous);

  std::shared_ptr<TaskRunner> managed_task_runner(const std::string& callback,
                                                  const std::shared_ptr<CallbackGroup>& group);
  void manage(const std::shared_ptr<Managed>& entity);
  std::vector<std::shared_ptr<Managed>> managed() const;
  void start_managed();
  void stop_managed();

  const std::shared_ptr<CallbackGate> gate_ = std::make_shared<CallbackGate>();
  std::atomic<LifecycleState> state_{LifecycleState::unconfigured};
  std::atomic<bool> is_changing_{false};  // the thread that sets it may change the state

  mutable PiMutex managed_mutex_;
  std::vector<std::weak_ptr<Managed>> managed_;

  PiMutex listener_mutex_;  // guards the next one
  using Listener = detail::Removable<void(const LifecycleTransition&)>;
  std::shared_ptr<Listener> listener_;
};

}  // namespace takt

#endif  // TAKT_NODES_LIFECYCLE_NODE_HPP_
