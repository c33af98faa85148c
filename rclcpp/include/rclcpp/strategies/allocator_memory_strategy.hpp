// rclcpp's memory strategy for executors. Takt's executors have their own, and ignore this one.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_
#define RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_

#include <memory>

#include "rclcpp/memory_strategy.hpp"

namespace rclcpp::memory_strategies::allocator_memory_strategy {

/// Nothing calls it: see docs/reference/rclcpp.md.
/// Thread safety: immutable. Real-time: yes.
template <class Allocator = std::allocator<void>>
class AllocatorMemoryStrategy : public memory_strategy::MemoryStrategy {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(AllocatorMemoryStrategy)
  AllocatorMemoryStrategy() = default;
  explicit AllocatorMemoryStrategy(const std::shared_ptr<Allocator>&) {}
};

}  // namespace rclcpp::memory_strategies::allocator_memory_strategy

#endif  // RCLCPP__STRATEGIES__ALLOCATOR_MEMORY_STRATEGY_HPP_
