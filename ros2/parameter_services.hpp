// ROS 2's services for the parameters of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_PARAMETER_SERVICES_HPP_
#define TAKT_ROS2_PARAMETER_SERVICES_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_event.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_value.hpp"
#include "takt/messages/rcl_interfaces/srv/describe_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/get_parameter_types.hpp"
#include "takt/messages/rcl_interfaces/srv/get_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/list_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/set_parameters.hpp"
#include "takt/messages/rcl_interfaces/srv/set_parameters_atomically.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Converts a value to its message, and back. Throws Error when the message has an unknown type.
rcl_interfaces::msg::ParameterValue to_message(const ParameterValue& value);
ParameterValue from_message(const rcl_interfaces::msg::ParameterValue& message);

/// Serves get_parameters, get_parameter_types, set_parameters, set_parameters_atomically,
/// list_parameters and describe_parameters under the full name of a node, for `ros2 param` and
/// other clients. They answer as rclcpp's do: one name that was not declared makes the answers of
/// get_parameters, get_parameter_types and describe_parameters empty; set_parameters sets one after
/// another and has a result for each. An exception of a parameter callback gives a negative result;
/// after the response, the service's callback throws it. `/parameter_events` reports the parameters
/// that are declared, set and undeclared: initially all of them.
///
/// The services are entities of the host: the node itself, or another node whose executor is not a
/// real-time one. The services that set parameters run callbacks of the node, and are in `group`;
/// the others are in the host's default callback group. With a thread for each group, a callback
/// that does not return keeps no reader waiting. In ROS 2's graph the services belong to the node.
/// Both nodes must outlive this object. After its destructor, no request is served any more.
///
/// Thread safety: as Node.
/// Real-time: no; they copy names and values, and call the node's parameter callbacks.
class ParameterServices {
 public:
  /// `group`: a callback group of the host; nullptr: its default group.
  ParameterServices(Node& node, Node& host, const std::shared_ptr<CallbackGroup>& group = nullptr);
  ~ParameterServices() { node_.set_parameters_listener({}); }
  ParameterServices(const ParameterServices&) = delete;
  ParameterServices& operator=(const ParameterServices&) = delete;

 private:
  template <class S>
  using Handle = std::shared_ptr<Service<S>>;

  void publish(const ParameterChanges& changes) const;

  Node& node_;
  const std::shared_ptr<Publisher<rcl_interfaces::msg::ParameterEvent>> events_;
  const Handle<rcl_interfaces::srv::GetParameters> get_;
  const Handle<rcl_interfaces::srv::GetParameterTypes> get_types_;
  const Handle<rcl_interfaces::srv::SetParameters> set_;
  const Handle<rcl_interfaces::srv::SetParametersAtomically> set_atomically_;
  const Handle<rcl_interfaces::srv::ListParameters> list_;
  const Handle<rcl_interfaces::srv::DescribeParameters> describe_;
};

}  // namespace takt

#endif  // TAKT_ROS2_PARAMETER_SERVICES_HPP_
