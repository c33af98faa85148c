// All of actions.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__RCLCPP_ACTION_HPP_
#define RCLCPP_ACTION__RCLCPP_ACTION_HPP_

#include "rclcpp_action/client.hpp"
#include "rclcpp_action/server.hpp"

#endif  // RCLCPP_ACTION__RCLCPP_ACTION_HPP_
