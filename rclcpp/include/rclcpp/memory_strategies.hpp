// The default memory strategy of rclcpp's executors.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__MEMORY_STRATEGIES_HPP_
#define RCLCPP__MEMORY_STRATEGIES_HPP_

#include "rclcpp/strategies/allocator_memory_strategy.hpp"

namespace rclcpp::memory_strategies {

inline memory_strategy::MemoryStrategy::SharedPtr create_default_strategy() {
  return std::make_shared<allocator_memory_strategy::AllocatorMemoryStrategy<>>();
}

}  // namespace rclcpp::memory_strategies

#endif  // RCLCPP__MEMORY_STRATEGIES_HPP_
