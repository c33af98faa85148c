// The macros that log.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__LOGGING_HPP_
#define RCLCPP__LOGGING_HPP_

#include <atomic>
#include <cstdint>
#include <limits>
#include <sstream>
#include <type_traits>

#include "rclcpp/logger.hpp"
#include "rcutils/logging.h"

namespace rclcpp::detail {

struct LogLocation {
  const char* function;
  const char* file;
  unsigned line;
};
/// Writes a line at once, as rclcpp does: formatting allocates, and the write may block.
void log(const Logger& logger, int severity, const LogLocation& where, const char* format, ...)
    __attribute__((format(printf, 4, 5)));

/// The rate limit of one call site: whether so many milliseconds have passed since it logged last.
template <class Clock>
bool throttle(std::atomic<std::int64_t>& last, Clock& clock, std::int64_t duration_ms) {
  const std::int64_t now = clock.now().nanoseconds();
  std::int64_t before = last.load(std::memory_order_relaxed);
  // After the clock was set back, the limit starts anew.
  const bool may = before == std::numeric_limits<std::int64_t>::min() || now < before ||
                   now - before >= duration_ms * 1'000'000;
  return may && last.compare_exchange_strong(before, now, std::memory_order_relaxed);
}

}  // namespace rclcpp::detail

#define RCLCPP_STATIC_ASSERT_LOGGER(logger)                                                 \
  static_assert(std::is_same_v<std::remove_cv_t<std::remove_reference_t<decltype(logger)>>, \
                               ::rclcpp::Logger>,                                           \
                "First argument to logging macros must be an rclcpp::Logger")

#define RCLCPP_LOG_IF_(severity, logger, condition, ...)                              \
  do {                                                                                \
    RCLCPP_STATIC_ASSERT_LOGGER(logger);                                              \
    if (const ::rclcpp::Logger& rclcpp_logger_ = (logger);                            \
        rclcpp_logger_.is_enabled(severity) && (condition)) {                         \
      ::rclcpp::detail::log(rclcpp_logger_, severity, {__func__, __FILE__, __LINE__}, \
                            __VA_ARGS__);                                             \
    }                                                                                 \
  } while (0)
#define RCLCPP_LOG_STREAM_IF_(severity, logger, condition, ...)                             \
  do {                                                                                      \
    RCLCPP_STATIC_ASSERT_LOGGER(logger);                                                    \
    if (const ::rclcpp::Logger& rclcpp_logger_ = (logger);                                  \
        rclcpp_logger_.is_enabled(severity) && (condition)) {                               \
      std::stringstream rclcpp_stream_;                                                     \
      rclcpp_stream_ << __VA_ARGS__;                                                        \
      ::rclcpp::detail::log(rclcpp_logger_, severity, {__func__, __FILE__, __LINE__}, "%s", \
                            rclcpp_stream_.str().c_str());                                  \
    }                                                                                       \
  } while (0)

// Conditions with a state for each call site.
#define RCLCPP_ONCE_                        \
  ([]() noexcept {                          \
    static std::atomic<bool> logged{false}; \
    return !logged.exchange(true);          \
  }())
#define RCLCPP_NOT_FIRST_                   \
  ([]() noexcept {                          \
    static std::atomic<bool> called{false}; \
    return called.exchange(true);           \
  }())
#define RCLCPP_THROTTLED_(clock, duration)                                           \
  ([](auto& rclcpp_clock_, std::int64_t rclcpp_ms_) {                                \
    static std::atomic<std::int64_t> last{std::numeric_limits<std::int64_t>::min()}; \
    return ::rclcpp::detail::throttle(last, rclcpp_clock_, rclcpp_ms_);              \
  }((clock), static_cast<std::int64_t>(duration)))

#define RCLCPP_DEBUG(logger, ...) RCLCPP_LOG_IF_(10, logger, true, __VA_ARGS__)
#define RCLCPP_DEBUG_ONCE(logger, ...) RCLCPP_LOG_IF_(10, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_DEBUG_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_IF_(10, logger, (expression), __VA_ARGS__)
#define RCLCPP_DEBUG_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_IF_(10, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_DEBUG_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_IF_(10, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_DEBUG_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(10, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_DEBUG_SKIPFIRST_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(10, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM(logger, ...) RCLCPP_LOG_STREAM_IF_(10, logger, true, __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_ONCE(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(10, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_STREAM_IF_(10, logger, (expression), __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_STREAM_IF_(10, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(10, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_STREAM_IF_(10, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM_SKIPFIRST_THROTTLE(logger, clock, duration, ...)                \
  RCLCPP_LOG_STREAM_IF_(10, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), \
                        __VA_ARGS__)
#define RCLCPP_INFO(logger, ...) RCLCPP_LOG_IF_(20, logger, true, __VA_ARGS__)
#define RCLCPP_INFO_ONCE(logger, ...) RCLCPP_LOG_IF_(20, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_INFO_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_IF_(20, logger, (expression), __VA_ARGS__)
#define RCLCPP_INFO_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_IF_(20, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_INFO_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_IF_(20, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_INFO_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(20, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_INFO_SKIPFIRST_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(20, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_INFO_STREAM(logger, ...) RCLCPP_LOG_STREAM_IF_(20, logger, true, __VA_ARGS__)
#define RCLCPP_INFO_STREAM_ONCE(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(20, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_INFO_STREAM_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_STREAM_IF_(20, logger, (expression), __VA_ARGS__)
#define RCLCPP_INFO_STREAM_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_STREAM_IF_(20, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_INFO_STREAM_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(20, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_INFO_STREAM_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_STREAM_IF_(20, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_INFO_STREAM_SKIPFIRST_THROTTLE(logger, clock, duration, ...)                 \
  RCLCPP_LOG_STREAM_IF_(20, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), \
                        __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) RCLCPP_LOG_IF_(30, logger, true, __VA_ARGS__)
#define RCLCPP_WARN_ONCE(logger, ...) RCLCPP_LOG_IF_(30, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_WARN_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_IF_(30, logger, (expression), __VA_ARGS__)
#define RCLCPP_WARN_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_IF_(30, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_WARN_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_IF_(30, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(30, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_WARN_SKIPFIRST_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(30, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_WARN_STREAM(logger, ...) RCLCPP_LOG_STREAM_IF_(30, logger, true, __VA_ARGS__)
#define RCLCPP_WARN_STREAM_ONCE(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(30, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_WARN_STREAM_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_STREAM_IF_(30, logger, (expression), __VA_ARGS__)
#define RCLCPP_WARN_STREAM_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_STREAM_IF_(30, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_WARN_STREAM_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(30, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_WARN_STREAM_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_STREAM_IF_(30, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_WARN_STREAM_SKIPFIRST_THROTTLE(logger, clock, duration, ...)                 \
  RCLCPP_LOG_STREAM_IF_(30, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), \
                        __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) RCLCPP_LOG_IF_(40, logger, true, __VA_ARGS__)
#define RCLCPP_ERROR_ONCE(logger, ...) RCLCPP_LOG_IF_(40, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_ERROR_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_IF_(40, logger, (expression), __VA_ARGS__)
#define RCLCPP_ERROR_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_IF_(40, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_ERROR_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_IF_(40, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_ERROR_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(40, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_ERROR_SKIPFIRST_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(40, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_ERROR_STREAM(logger, ...) RCLCPP_LOG_STREAM_IF_(40, logger, true, __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_ONCE(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(40, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_STREAM_IF_(40, logger, (expression), __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_STREAM_IF_(40, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(40, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_STREAM_IF_(40, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_ERROR_STREAM_SKIPFIRST_THROTTLE(logger, clock, duration, ...)                \
  RCLCPP_LOG_STREAM_IF_(40, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), \
                        __VA_ARGS__)
#define RCLCPP_FATAL(logger, ...) RCLCPP_LOG_IF_(50, logger, true, __VA_ARGS__)
#define RCLCPP_FATAL_ONCE(logger, ...) RCLCPP_LOG_IF_(50, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_FATAL_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_IF_(50, logger, (expression), __VA_ARGS__)
#define RCLCPP_FATAL_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_IF_(50, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_FATAL_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_IF_(50, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_FATAL_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(50, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_FATAL_SKIPFIRST_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_IF_(50, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_FATAL_STREAM(logger, ...) RCLCPP_LOG_STREAM_IF_(50, logger, true, __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_ONCE(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(50, logger, RCLCPP_ONCE_, __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_EXPRESSION(logger, expression, ...) \
  RCLCPP_LOG_STREAM_IF_(50, logger, (expression), __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_FUNCTION(logger, function, ...) \
  RCLCPP_LOG_STREAM_IF_(50, logger, (*(function))(), __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_SKIPFIRST(logger, ...) \
  RCLCPP_LOG_STREAM_IF_(50, logger, RCLCPP_NOT_FIRST_, __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_THROTTLE(logger, clock, duration, ...) \
  RCLCPP_LOG_STREAM_IF_(50, logger, RCLCPP_THROTTLED_(clock, duration), __VA_ARGS__)
#define RCLCPP_FATAL_STREAM_SKIPFIRST_THROTTLE(logger, clock, duration, ...)                \
  RCLCPP_LOG_STREAM_IF_(50, logger, RCLCPP_NOT_FIRST_&& RCLCPP_THROTTLED_(clock, duration), \
                        __VA_ARGS__)

#endif  // RCLCPP__LOGGING_HPP_
