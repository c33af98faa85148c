// rclcpp's allocation of received messages. Takt allocates messages itself, and ignores this.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__MESSAGE_MEMORY_STRATEGY_HPP_
#define RCLCPP__MESSAGE_MEMORY_STRATEGY_HPP_

#include <memory>

#include "rclcpp/macros.hpp"

namespace rclcpp::message_memory_strategy {

/// Nothing calls it: see docs/reference/rclcpp.md.
/// Thread safety: immutable. Real-time: yes.
template <class M, class Allocator = std::allocator<void>>
class MessageMemoryStrategy {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(MessageMemoryStrategy)
  MessageMemoryStrategy() = default;
  explicit MessageMemoryStrategy(const std::shared_ptr<Allocator>&) {}
  static SharedPtr create_default() { return std::make_shared<MessageMemoryStrategy>(); }
};

}  // namespace rclcpp::message_memory_strategy

#endif  // RCLCPP__MESSAGE_MEMORY_STRATEGY_HPP_
