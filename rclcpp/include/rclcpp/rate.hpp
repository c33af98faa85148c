// Loops with a period.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__RATE_HPP_
#define RCLCPP__RATE_HPP_

#include <chrono>
#include <memory>

#include "rclcpp/clock.hpp"

namespace rclcpp {

/// Thread safety: of one thread. Real-time: it sleeps.
class RateBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(RateBase)
  virtual ~RateBase() = default;
  virtual bool sleep() = 0;
  virtual rcl_clock_type_t get_type() const = 0;
  virtual void reset() = 0;
};

/// Throws std::invalid_argument when the rate is not positive.
class Rate : public RateBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Rate)
  explicit Rate(double hz, Clock::SharedPtr clock = std::make_shared<Clock>(RCL_SYSTEM_TIME));
  explicit Rate(const Duration& period,
                Clock::SharedPtr clock = std::make_shared<Clock>(RCL_SYSTEM_TIME));

  /// Sleeps until the next period begins. False, without a sleep, when it has begun already.
  bool sleep() override;
  rcl_clock_type_t get_type() const override { return clock_->get_clock_type(); }
  void reset() override { last_ = clock_->read(); }
  std::chrono::nanoseconds period() const { return period_.to_chrono(); }

 private:
  const Clock::SharedPtr clock_;
  const Duration period_;
  takt::SourceTime last_;  // when the last period began
};
class WallRate : public Rate {
 public:
  explicit WallRate(double hz) : Rate(hz, std::make_shared<Clock>(RCL_STEADY_TIME)) {}
  explicit WallRate(const Duration& period)
      : Rate(period, std::make_shared<Clock>(RCL_STEADY_TIME)) {}
};
class ROSRate : public Rate {
 public:
  explicit ROSRate(double hz) : Rate(hz, std::make_shared<Clock>(RCL_ROS_TIME)) {}
  explicit ROSRate(const Duration& period) : Rate(period, std::make_shared<Clock>(RCL_ROS_TIME)) {}
};

}  // namespace rclcpp

#endif  // RCLCPP__RATE_HPP_
