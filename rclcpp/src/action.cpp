// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action.hpp"

#include "rclcpp_action/types.hpp"

namespace rclcpp_action {

std::string to_string(const GoalUUID& id) {
  takt::GoalId goal;
  goal.uuid = id;
  return takt::to_string(goal);
}

}  // namespace rclcpp_action
