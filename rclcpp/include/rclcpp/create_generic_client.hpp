// Not supported: generic clients.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CREATE_GENERIC_CLIENT_HPP_
#define RCLCPP__CREATE_GENERIC_CLIENT_HPP_

#error "Takt's layer for rclcpp has no generic clients: see docs/reference/rclcpp.md"

#endif  // RCLCPP__CREATE_GENERIC_CLIENT_HPP_
