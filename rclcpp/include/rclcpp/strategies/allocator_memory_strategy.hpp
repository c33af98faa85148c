// Not supported: memory strategies.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_
#define RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_

#error "Takt's layer for rclcpp has no memory strategies: see docs/reference/rclcpp.md"

#endif  // RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_
