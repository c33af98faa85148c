// The clock of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_CLOCK_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_CLOCK_INTERFACE_HPP_

#include "rclcpp/clock.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"

namespace rclcpp::node_interfaces {

/// Thread safety: every method from any thread. Real-time: yes.
class NodeClockInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeClockInterface)
  explicit NodeClockInterface(NodeBaseInterface& node)
      : clock_(node.options().clock_type() == RCL_ROS_TIME
                   ? std::make_shared<Clock>(node.takt_node()->clock().as_simulated())
                   : std::make_shared<Clock>(node.options().clock_type())) {}

  Clock::SharedPtr get_clock() { return clock_; }
  Clock::ConstSharedPtr get_clock() const { return clock_; }

 private:
  const Clock::SharedPtr clock_;
};

}  // namespace rclcpp::node_interfaces

#endif  // RCLCPP__NODE_INTERFACES__NODE_CLOCK_INTERFACE_HPP_
