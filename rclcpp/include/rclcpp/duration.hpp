// Durations, as programs for rclcpp write them.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DURATION_HPP_
#define RCLCPP__DURATION_HPP_

#include <chrono>
#include <cstdint>

#include "takt/messages/builtin_interfaces/msg/duration.hpp"

#include "rcl/time.h"
#include "rclcpp/detail/standard_headers.hpp"
#include "rmw/types.h"

namespace rclcpp {

/// Nanoseconds with a sign. Arithmetic that overflows throws std::overflow_error.
/// Thread safety: a value. Real-time: yes, unless it throws.
class Duration {
 public:
  Duration(std::int32_t seconds, std::uint32_t nanoseconds);
  explicit Duration(std::chrono::nanoseconds nanoseconds) : ns_(nanoseconds.count()) {}
  template <class Rep, class Period>
  Duration(const std::chrono::duration<Rep, Period>& duration)  // NOLINT: as in rclcpp
      : ns_(std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count()) {}
  Duration(const builtin_interfaces::msg::Duration& message);  // NOLINT
  Duration() = default;
  Duration(const Duration&) = default;
  Duration& operator=(const Duration&) = default;
  ~Duration() {}  // NOLINT: not trivial, see Time

  static Duration from_seconds(double seconds);
  static Duration from_nanoseconds(rcl_duration_value_t nanoseconds) {
    return Duration(std::chrono::nanoseconds(nanoseconds));
  }
  static Duration from_rmw_time(rmw_time_t time);
  static Duration max();

  operator builtin_interfaces::msg::Duration() const;  // NOLINT

  friend bool operator==(const Duration&, const Duration&) = default;
  friend bool operator==(const Duration& duration, const builtin_interfaces::msg::Duration& other) {
    return duration == Duration(other);  // C++20 would ask which one to convert
  }
  friend auto operator<=>(const Duration&, const Duration&) = default;
  Duration operator+(const Duration& other) const;
  Duration operator-(const Duration& other) const;
  Duration operator-() const { return from_nanoseconds(0) - *this; }
  Duration& operator+=(const Duration& other) { return *this = *this + other; }
  Duration& operator-=(const Duration& other) { return *this = *this - other; }
  Duration operator*(double scale) const;
  Duration& operator*=(double scale) { return *this = *this * scale; }

  rcl_duration_value_t nanoseconds() const { return ns_; }
  double seconds() const { return std::chrono::duration<double>(to_chrono()).count(); }
  template <class To = std::chrono::nanoseconds>
  To to_chrono() const {
    return std::chrono::duration_cast<To>(std::chrono::nanoseconds(ns_));
  }
  rmw_time_t to_rmw_time() const;

 private:
  rcl_duration_value_t ns_ = 0;
};

}  // namespace rclcpp

#endif  // RCLCPP__DURATION_HPP_
