// The timers interface of a node, which adds them to it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_TIMERS_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_TIMERS_INTERFACE_HPP_

#include <utility>

#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/timer.hpp"

namespace rclcpp::node_interfaces {

/// Thread safety: every method from any thread. Real-time: set-up only.
class NodeTimersInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeTimersInterface)
  explicit NodeTimersInterface(NodeBaseInterface::SharedPtr node) : node_(std::move(node)) {}
  const NodeBaseInterface::SharedPtr& get_node_base_interface() const { return node_; }
  /// For timers that a program makes itself. Throws std::runtime_error if it has been added before.
  void add_timer(TimerBase::SharedPtr timer, CallbackGroup::SharedPtr group) {
    timer->add_to(*node_->takt_node(), node_->next_timer_name(timer->period()), std::move(group));
  }

 private:
  const NodeBaseInterface::SharedPtr node_;
};

}  // namespace rclcpp::node_interfaces

#endif  // RCLCPP__NODE_INTERFACES__NODE_TIMERS_INTERFACE_HPP_
