// Wakes a wait set.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__GUARD_CONDITION_HPP_
#define RCLCPP__GUARD_CONDITION_HPP_

#include <memory>

#include "takt/entities/guard_condition.hpp"

#include "rclcpp/context.hpp"
#include "rclcpp/macros.hpp"

namespace rclcpp {

/// Thread safety and real-time: as takt::GuardCondition.
class GuardCondition {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS_NOT_COPYABLE(GuardCondition)
  explicit GuardCondition(
      const Context::SharedPtr& context = contexts::get_global_default_context())
      : context_(context),
        takt_(std::make_shared<takt::GuardCondition>(
            "guard_condition", nullptr, takt::Clock::steady(), std::function<void()>())) {}
  ~GuardCondition() { takt_->retire(); }

  Context::SharedPtr get_context() const { return context_; }
  void trigger() { takt_->trigger(); }

  // For this library.
  const std::shared_ptr<takt::GuardCondition>& entity() const { return takt_; }

 private:
  const Context::SharedPtr context_;
  const std::shared_ptr<takt::GuardCondition> takt_;
};

}  // namespace rclcpp

#endif  // RCLCPP__GUARD_CONDITION_HPP_
