// Not supported: time sources of their own.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TIME_SOURCE_HPP_
#define RCLCPP__TIME_SOURCE_HPP_

#error "Takt's layer for rclcpp has no time sources of their own: see docs/reference/rclcpp.md"

#endif  // RCLCPP__TIME_SOURCE_HPP_
