// The name that programs include for what is in rclcpp_action/client.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__CLIENT_GOAL_HANDLE_HPP_
#define RCLCPP_ACTION__CLIENT_GOAL_HANDLE_HPP_

#include "rclcpp_action/client.hpp"

#endif  // RCLCPP_ACTION__CLIENT_GOAL_HANDLE_HPP_
