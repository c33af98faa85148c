// The macros that log by the name of a logger.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__LOGGING_MACROS_H_
#define RCUTILS__LOGGING_MACROS_H_

#include "rclcpp/clock.hpp"
#include "rclcpp/logging.hpp"

namespace rclcpp::detail {
inline Clock& clock_of(rcl_clock_type_t type) {
  static Clock steady(RCL_STEADY_TIME), system(RCL_SYSTEM_TIME);
  return type == RCL_STEADY_TIME ? steady : system;
}
}  // namespace rclcpp::detail

// Clocks for throttled lines.
#define RCUTILS_STEADY_TIME ::rclcpp::detail::clock_of(RCL_STEADY_TIME)
#define RCUTILS_SYSTEM_TIME ::rclcpp::detail::clock_of(RCL_SYSTEM_TIME)

#define RCUTILS_LOG_DEBUG_NAMED(name, ...) RCLCPP_DEBUG(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_ONCE_NAMED(name, ...) \
  RCLCPP_DEBUG_ONCE(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_EXPRESSION_NAMED(expression, name, ...) \
  RCLCPP_DEBUG_EXPRESSION(::rclcpp::get_logger(name), expression, __VA_ARGS__)
#define RCUTILS_LOG_DEBUG(...) RCUTILS_LOG_DEBUG_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_ONCE(...) RCUTILS_LOG_DEBUG_ONCE_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_EXPRESSION(expression, ...) \
  RCUTILS_LOG_DEBUG_EXPRESSION_NAMED(expression, "", __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_THROTTLE_NAMED(clock, duration, name, ...) \
  RCLCPP_DEBUG_THROTTLE(::rclcpp::get_logger(name), clock, duration, __VA_ARGS__)
#define RCUTILS_LOG_DEBUG_THROTTLE(clock, duration, ...) \
  RCUTILS_LOG_DEBUG_THROTTLE_NAMED(clock, duration, "", __VA_ARGS__)
#define RCUTILS_LOG_INFO_NAMED(name, ...) RCLCPP_INFO(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_INFO_ONCE_NAMED(name, ...) \
  RCLCPP_INFO_ONCE(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_INFO_EXPRESSION_NAMED(expression, name, ...) \
  RCLCPP_INFO_EXPRESSION(::rclcpp::get_logger(name), expression, __VA_ARGS__)
#define RCUTILS_LOG_INFO(...) RCUTILS_LOG_INFO_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_INFO_ONCE(...) RCUTILS_LOG_INFO_ONCE_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_INFO_EXPRESSION(expression, ...) \
  RCUTILS_LOG_INFO_EXPRESSION_NAMED(expression, "", __VA_ARGS__)
#define RCUTILS_LOG_INFO_THROTTLE_NAMED(clock, duration, name, ...) \
  RCLCPP_INFO_THROTTLE(::rclcpp::get_logger(name), clock, duration, __VA_ARGS__)
#define RCUTILS_LOG_INFO_THROTTLE(clock, duration, ...) \
  RCUTILS_LOG_INFO_THROTTLE_NAMED(clock, duration, "", __VA_ARGS__)
#define RCUTILS_LOG_WARN_NAMED(name, ...) RCLCPP_WARN(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_WARN_ONCE_NAMED(name, ...) \
  RCLCPP_WARN_ONCE(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_WARN_EXPRESSION_NAMED(expression, name, ...) \
  RCLCPP_WARN_EXPRESSION(::rclcpp::get_logger(name), expression, __VA_ARGS__)
#define RCUTILS_LOG_WARN(...) RCUTILS_LOG_WARN_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_WARN_ONCE(...) RCUTILS_LOG_WARN_ONCE_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_WARN_EXPRESSION(expression, ...) \
  RCUTILS_LOG_WARN_EXPRESSION_NAMED(expression, "", __VA_ARGS__)
#define RCUTILS_LOG_WARN_THROTTLE_NAMED(clock, duration, name, ...) \
  RCLCPP_WARN_THROTTLE(::rclcpp::get_logger(name), clock, duration, __VA_ARGS__)
#define RCUTILS_LOG_WARN_THROTTLE(clock, duration, ...) \
  RCUTILS_LOG_WARN_THROTTLE_NAMED(clock, duration, "", __VA_ARGS__)
#define RCUTILS_LOG_ERROR_NAMED(name, ...) RCLCPP_ERROR(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_ERROR_ONCE_NAMED(name, ...) \
  RCLCPP_ERROR_ONCE(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_ERROR_EXPRESSION_NAMED(expression, name, ...) \
  RCLCPP_ERROR_EXPRESSION(::rclcpp::get_logger(name), expression, __VA_ARGS__)
#define RCUTILS_LOG_ERROR(...) RCUTILS_LOG_ERROR_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_ERROR_ONCE(...) RCUTILS_LOG_ERROR_ONCE_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_ERROR_EXPRESSION(expression, ...) \
  RCUTILS_LOG_ERROR_EXPRESSION_NAMED(expression, "", __VA_ARGS__)
#define RCUTILS_LOG_ERROR_THROTTLE_NAMED(clock, duration, name, ...) \
  RCLCPP_ERROR_THROTTLE(::rclcpp::get_logger(name), clock, duration, __VA_ARGS__)
#define RCUTILS_LOG_ERROR_THROTTLE(clock, duration, ...) \
  RCUTILS_LOG_ERROR_THROTTLE_NAMED(clock, duration, "", __VA_ARGS__)
#define RCUTILS_LOG_FATAL_NAMED(name, ...) RCLCPP_FATAL(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_FATAL_ONCE_NAMED(name, ...) \
  RCLCPP_FATAL_ONCE(::rclcpp::get_logger(name), __VA_ARGS__)
#define RCUTILS_LOG_FATAL_EXPRESSION_NAMED(expression, name, ...) \
  RCLCPP_FATAL_EXPRESSION(::rclcpp::get_logger(name), expression, __VA_ARGS__)
#define RCUTILS_LOG_FATAL(...) RCUTILS_LOG_FATAL_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_FATAL_ONCE(...) RCUTILS_LOG_FATAL_ONCE_NAMED("", __VA_ARGS__)
#define RCUTILS_LOG_FATAL_EXPRESSION(expression, ...) \
  RCUTILS_LOG_FATAL_EXPRESSION_NAMED(expression, "", __VA_ARGS__)
#define RCUTILS_LOG_FATAL_THROTTLE_NAMED(clock, duration, name, ...) \
  RCLCPP_FATAL_THROTTLE(::rclcpp::get_logger(name), clock, duration, __VA_ARGS__)
#define RCUTILS_LOG_FATAL_THROTTLE(clock, duration, ...) \
  RCUTILS_LOG_FATAL_THROTTLE_NAMED(clock, duration, "", __VA_ARGS__)

#endif  // RCUTILS__LOGGING_MACROS_H_
