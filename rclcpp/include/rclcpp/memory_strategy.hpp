// Memory strategies of executors: Takt's executors have their own, and ignore these.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__MEMORY_STRATEGY_HPP_
#define RCLCPP__MEMORY_STRATEGY_HPP_

#include "rclcpp/macros.hpp"

namespace rclcpp::memory_strategy {

class MemoryStrategy {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(MemoryStrategy)
  virtual ~MemoryStrategy() = default;
};

}  // namespace rclcpp::memory_strategy

#endif  // RCLCPP__MEMORY_STRATEGY_HPP_
