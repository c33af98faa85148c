// ROS 2's services of a lifecycle node: other processes read and change its state.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_LIFECYCLE_SERVICES_HPP_
#define TAKT_ROS2_LIFECYCLE_SERVICES_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/messages/lifecycle_msgs/msg/transition_event.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_available_states.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_available_transitions.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_state.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace TAKT_PUBLIC takt {

/// ROS 2's interface of a managed node, as `ros2 lifecycle` and launch files use it: the services
/// ~/change_state, ~/get_state, ~/get_available_states, ~/get_available_transitions,
/// ~/get_transition_graph and the topic ~/transition_event, under the node's name. change_state
/// looks at the request's label, and at its id if that is empty; a request that is refused is
/// answered without success, and the log says why.
///
/// Thread safety: make and drop it on any thread, while no other thread does so for the same node.
/// Real-time: change_state runs the callbacks of the node, and may wait for its managed callbacks:
/// so the host is a node whose executor may block. Answers allocate.
/// Errors: as Node::create_service.
class LifecycleServices {
 public:
  /// The services and the publisher are entities of `host`, which may be the node itself, or one on
  /// another executor; in ROS 2's graph they belong to the node. Both nodes must outlive this
  /// object. `group`, a group of the host, is that of change_state. The other services run no
  /// callback of the node, and are in the host's default group: with a thread for each group,
  /// get_state answers while the node is configuring.
  LifecycleServices(LifecycleNode& node, Node& host,
                    const std::shared_ptr<CallbackGroup>& group = nullptr);
  ~LifecycleServices();
  LifecycleServices(const LifecycleServices&) = delete;
  LifecycleServices& operator=(const LifecycleServices&) = delete;

 private:
  LifecycleNode& node_;
  const std::shared_ptr<Publisher<lifecycle_msgs::msg::TransitionEvent>> transition_event_;
  const std::shared_ptr<Service<lifecycle_msgs::srv::ChangeState>> change_state_;
  const std::shared_ptr<Service<lifecycle_msgs::srv::GetState>> get_state_;
  const std::shared_ptr<Service<lifecycle_msgs::srv::GetAvailableStates>> get_available_states_;
  const std::shared_ptr<Service<lifecycle_msgs::srv::GetAvailableTransitions>> get_transitions_,
      get_transition_graph_;
};

}  // namespace takt

#endif  // TAKT_ROS2_LIFECYCLE_SERVICES_HPP_
