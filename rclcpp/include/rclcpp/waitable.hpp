// Not supported: waitables.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__WAITABLE_HPP_
#define RCLCPP__WAITABLE_HPP_

#error "Takt's layer for rclcpp has no waitables: see docs/reference/rclcpp.md"

#endif  // RCLCPP__WAITABLE_HPP_
