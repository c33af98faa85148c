// Nodes with states, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_LIFECYCLE__LIFECYCLE_NODE_HPP_
#define RCLCPP_LIFECYCLE__LIFECYCLE_NODE_HPP_

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "takt/entities/callback_list.hpp"
#include "takt/ros2/lifecycle_services.hpp"

#include "rclcpp/detail/node_api.hpp"
#include "rclcpp/logging.hpp"
#include "rclcpp_lifecycle/lifecycle_publisher.hpp"
#include "rclcpp_lifecycle/node_interfaces/lifecycle_node_interface.hpp"

namespace rclcpp_lifecycle {

/// As in rclcpp, only its publishers are managed; Takt's own LifecycleNode manages more.
/// Thread safety: every method from any thread. Real-time: requests run the user's code.
class LifecycleNode : public rclcpp::detail::NodeApi,
                      public node_interfaces::LifecycleNodeInterface,
                      public std::enable_shared_from_this<LifecycleNode> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(LifecycleNode)

  explicit LifecycleNode(const std::string& name,
                         const rclcpp::NodeOptions& options = rclcpp::NodeOptions(),
                         bool enable_communication_interface = true)
      : LifecycleNode(name, "", options, enable_communication_interface) {}
  LifecycleNode(const std::string& name, const std::string& name_space,
                const rclcpp::NodeOptions& options = rclcpp::NodeOptions(),
                bool enable_communication_interface = true);
  ~LifecycleNode() override;

  template <class M, class Allocator = std::allocator<void>>
  std::shared_ptr<LifecyclePublisher<M, Allocator>> create_publisher(
      const std::string& topic, const rclcpp::QoS& qos,
      const rclcpp::PublisherOptionsWithAllocator<Allocator>& options = {}) {
    using P = LifecyclePublisher<M, Allocator>;
    auto publisher = rclcpp::create_publisher<M, Allocator, P>(
        get_node_parameters_interface(), get_node_base_interface(), in_sub(topic), qos, options);
    add_managed_entity(publisher);
    return publisher;
  }
  /// The entity is activated and deactivated with the node; the caller owns it.
  void add_managed_entity(std::weak_ptr<ManagedEntityInterface> entity);

  const State& get_current_state() const;
  std::vector<State> get_available_states() const;
  std::vector<Transition> get_available_transitions() const;
  std::vector<Transition> get_transition_graph() const;

  // Each returns the new state, and sets `returned` to the result of the callback, or to FAILURE
  // when no callback was called.
  const State& trigger_transition(std::uint8_t id);
  const State& trigger_transition(std::uint8_t id, CallbackReturn& returned);
  const State& trigger_transition(const Transition& transition) {
    return trigger_transition(transition.id());
  }
  const State& trigger_transition(const Transition& transition, CallbackReturn& returned) {
    return trigger_transition(transition.id(), returned);
  }
#define RCLCPP_LIFECYCLE_REQUEST_(name)         \
  const State& name() {                         \
    return request(#name, nullptr);             \
  }                                             \
  const State& name(CallbackReturn& returned) { \
    return request(#name, &returned);           \
  }
  RCLCPP_LIFECYCLE_REQUEST_(configure)
  RCLCPP_LIFECYCLE_REQUEST_(cleanup)
  RCLCPP_LIFECYCLE_REQUEST_(activate)
  RCLCPP_LIFECYCLE_REQUEST_(deactivate)
  RCLCPP_LIFECYCLE_REQUEST_(shutdown)
#undef RCLCPP_LIFECYCLE_REQUEST_

  // The callback replaces the virtual function of the same name, and any callback registered
  // before. Registration waits if another thread is in the old callback.
#define RCLCPP_LIFECYCLE_REGISTER_(name, during)                                  \
  bool register_on_##name(std::function<CallbackReturn(const State&)> callback) { \
    return register_callback(takt::LifecycleState::during, std::move(callback));  \
  }
  RCLCPP_LIFECYCLE_REGISTER_(configure, configuring)
  RCLCPP_LIFECYCLE_REGISTER_(cleanup, cleaningup)
  RCLCPP_LIFECYCLE_REGISTER_(activate, activating)
  RCLCPP_LIFECYCLE_REGISTER_(deactivate, deactivating)
  RCLCPP_LIFECYCLE_REGISTER_(shutdown, shuttingdown)
  RCLCPP_LIFECYCLE_REGISTER_(error, errorprocessing)
#undef RCLCPP_LIFECYCLE_REGISTER_

  /// Activate and deactivate the managed entities: an override must call these, too.
  CallbackReturn on_activate(const State& previous) override;
  CallbackReturn on_deactivate(const State& previous) override;

 private:
  class Machine;
  using Callback = takt::detail::Removable<CallbackReturn(const State&)>;

  bool register_callback(takt::LifecycleState during, Callback::Function callback);
  CallbackReturn call(takt::LifecycleState during, takt::LifecycleState previous);
  const State& request(const char* label, CallbackReturn* returned);
  const State& result(const takt::TransitionResult& result, CallbackReturn* returned);
  template <class Use>
  void each_managed(Use&& use);

  Machine* const machine_;
  std::mutex mutex_;  // guards the next two
  std::vector<std::weak_ptr<ManagedEntityInterface>> managed_;
  std::map<takt::LifecycleState, std::shared_ptr<Callback>> callbacks_;
  std::unique_ptr<takt::LifecycleServices> services_;
};

}  // namespace rclcpp_lifecycle

#endif  // RCLCPP_LIFECYCLE__LIFECYCLE_NODE_HPP_
