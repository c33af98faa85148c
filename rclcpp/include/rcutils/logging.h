// Levels of loggers by their names.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__LOGGING_H_
#define RCUTILS__LOGGING_H_

#include <strings.h>

#include "rclcpp/logger.hpp"
#include "rcutils/allocator.h"
#include "rcutils/types/rcutils_ret.h"

enum RCUTILS_LOG_SEVERITY {
  RCUTILS_LOG_SEVERITY_UNSET = 0,
  RCUTILS_LOG_SEVERITY_DEBUG = 10,
  RCUTILS_LOG_SEVERITY_INFO = 20,
  RCUTILS_LOG_SEVERITY_WARN = 30,
  RCUTILS_LOG_SEVERITY_ERROR = 40,
  RCUTILS_LOG_SEVERITY_FATAL = 50,
};

inline rcutils_ret_t rcutils_logging_set_logger_level(const char* name, int level) {
  if (level < 0 || level > RCUTILS_LOG_SEVERITY_FATAL || level % 10 != 0) {
    return RCUTILS_RET_INVALID_ARGUMENT;
  }
  rclcpp::get_logger(name).set_level(static_cast<rclcpp::Logger::Level>(level));
  return RCUTILS_RET_OK;
}

inline int rcutils_logging_get_logger_effective_level(const char* name) {
  return static_cast<int>(rclcpp::get_logger(name).get_effective_level());
}

inline bool rcutils_logging_logger_is_enabled_for(const char* name, int severity) {
  return rclcpp::get_logger(name).is_enabled(severity);
}

/// Parses a level such as "info", ignoring case.
inline rcutils_ret_t rcutils_logging_severity_level_from_string(const char* text,
                                                                rcutils_allocator_t,
                                                                int* severity) {
  constexpr const char* kNames[] = {"UNSET", "DEBUG", "INFO", "WARN", "ERROR", "FATAL"};
  for (int number = 0; number < 6; ++number) {
    if (strcasecmp(text, kNames[number]) != 0) continue;
    *severity = 10 * number;
    return RCUTILS_RET_OK;
  }
  return RCUTILS_RET_LOGGING_SEVERITY_STRING_INVALID;
}

#endif  // RCUTILS__LOGGING_H_
