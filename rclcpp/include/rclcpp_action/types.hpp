// Names and states of goals.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__TYPES_HPP_
#define RCLCPP_ACTION__TYPES_HPP_

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "takt/messages/action_msgs/msg/goal_info.hpp"
#include "takt/messages/action_msgs/msg/goal_status.hpp"
#include "takt/messages/action_msgs/srv/cancel_goal.hpp"

namespace rclcpp_action {

using GoalUUID = std::array<std::uint8_t, 16>;
using GoalStatus = action_msgs::msg::GoalStatus;
using GoalInfo = action_msgs::msg::GoalInfo;

/// 32 hexadecimal digits.
std::string to_string(const GoalUUID& id);

enum class ResultCode : std::int8_t {
  UNKNOWN = GoalStatus::STATUS_UNKNOWN,
  SUCCEEDED = GoalStatus::STATUS_SUCCEEDED,
  CANCELED = GoalStatus::STATUS_CANCELED,
  ABORTED = GoalStatus::STATUS_ABORTED,
};
enum class GoalResponse : std::int8_t {
  REJECT = 1,
  ACCEPT_AND_EXECUTE = 2,
  ACCEPT_AND_DEFER = 3,
};
enum class CancelResponse : std::int8_t { REJECT = 1, ACCEPT = 2 };

}  // namespace rclcpp_action

template <>
struct std::hash<rclcpp_action::GoalUUID> {
  std::size_t operator()(const rclcpp_action::GoalUUID& id) const noexcept {
    std::size_t sum = 0;
    for (const std::uint8_t byte : id) sum = sum * 31 + byte;
    return sum;
  }
};

#endif  // RCLCPP_ACTION__TYPES_HPP_
