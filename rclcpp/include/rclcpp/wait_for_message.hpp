// Not supported: wait_for_message.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__WAIT_FOR_MESSAGE_HPP_
#define RCLCPP__WAIT_FOR_MESSAGE_HPP_

#error "Takt's layer for rclcpp has no wait_for_message: see docs/reference/rclcpp.md"

#endif  // RCLCPP__WAIT_FOR_MESSAGE_HPP_
