// The name that programs include for what is in rclcpp_action/server.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__SERVER_GOAL_HANDLE_HPP_
#define RCLCPP_ACTION__SERVER_GOAL_HANDLE_HPP_

#include "rclcpp_action/server.hpp"

#endif  // RCLCPP_ACTION__SERVER_GOAL_HANDLE_HPP_
