// Not supported: memory strategies.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__MEMORY_STRATEGIES_HPP_
#define RCLCPP__MEMORY_STRATEGIES_HPP_

#error "Takt's layer for rclcpp has no memory strategies: see docs/reference/rclcpp.md"

#endif  // RCLCPP__MEMORY_STRATEGIES_HPP_
