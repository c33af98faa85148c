// Points in time of a kind of clock, as programs for rclcpp write them.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TIME_HPP_
#define RCLCPP__TIME_HPP_

#include <compare>
#include <cstdint>

#include "takt/messages/builtin_interfaces/msg/time.hpp"

#include "rclcpp/duration.hpp"

namespace rclcpp {

/// Nanoseconds of one clock type. Comparing or subtracting times of different types throws
/// std::runtime_error; an overflow throws std::overflow_error.
/// Thread safety: a value. Real-time: yes, unless it throws.
class Time {
 public:
  Time(std::int32_t seconds, std::uint32_t nanoseconds, rcl_clock_type_t type = RCL_SYSTEM_TIME);
  explicit Time(std::int64_t nanoseconds = 0, rcl_clock_type_t type = RCL_SYSTEM_TIME)
      : ns_(nanoseconds), type_(type) {}
  Time(const builtin_interfaces::msg::Time& message,  // NOLINT: as in rclcpp
       rcl_clock_type_t type = RCL_ROS_TIME);
  static Time max(rcl_clock_type_t type = RCL_SYSTEM_TIME);
  Time(const Time&) = default;
  Time& operator=(const Time&) = default;
  // Not trivial, as in rclcpp: a compiler warns of variables that nobody reads if their types are
  // trivial, and generate_parameter_library makes such.
  ~Time() {}  // NOLINT

  operator builtin_interfaces::msg::Time() const;  // NOLINT
  Time& operator=(const builtin_interfaces::msg::Time& message) { return *this = Time(message); }

  bool operator==(const Time& other) const { return (*this <=> other) == 0; }
  // As in C++17, in which the left one decides: messages have no type of clock.
  using Message = builtin_interfaces::msg::Time;
  friend bool operator==(const Time& time, const Message& other) { return time == Time(other); }
  friend bool operator==(const Message& message, const Time& time) {
    return message == static_cast<Message>(time);
  }
  std::strong_ordering operator<=>(const Time& other) const;
  Time operator+(const Duration& duration) const;
  Time operator-(const Duration& duration) const;
  Duration operator-(const Time& other) const;
  Time& operator+=(const Duration& duration) { return *this = *this + duration; }
  Time& operator-=(const Duration& duration) { return *this = *this - duration; }

  rcl_time_point_value_t nanoseconds() const { return ns_; }
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::nanoseconds(ns_)).count();
  }
  rcl_clock_type_t get_clock_type() const { return type_; }

 private:
  rcl_time_point_value_t ns_ = 0;
  rcl_clock_type_t type_ = RCL_SYSTEM_TIME;
};

inline Time operator+(const Duration& duration, const Time& time) {
  return time + duration;
}
inline builtin_interfaces::msg::Time operator+(const builtin_interfaces::msg::Time& stamp,
                                               const Duration& duration) {
  return Time(stamp) + duration;
}
inline builtin_interfaces::msg::Time operator-(const builtin_interfaces::msg::Time& stamp,
                                               const Duration& duration) {
  return Time(stamp) - duration;
}

}  // namespace rclcpp

#endif  // RCLCPP__TIME_HPP_
