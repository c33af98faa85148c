// ROS 2's time and duration, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_BUILTIN_INTERFACES_HPP_
#define TAKT_MESSAGES_PACKAGES_BUILTIN_INTERFACES_HPP_

#include <chrono>
#include <cstdint>

#include "takt/messages/message_type.hpp"

namespace takt::builtin_interfaces {

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
TAKT_MESSAGE(Time, "builtin_interfaces/msg/Time", sec, nanosec);

struct Duration {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
TAKT_MESSAGE(Duration, "builtin_interfaces/msg/Duration", sec, nanosec);

}  // namespace takt::builtin_interfaces

namespace takt {

/// Time since 1970, as ROS 2 sends it.
inline builtin_interfaces::Time wire_time(std::chrono::system_clock::time_point time) noexcept {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const auto rest = std::chrono::duration_cast<std::chrono::nanoseconds>(time - seconds);
  return {static_cast<std::int32_t>(seconds.time_since_epoch().count()),
          static_cast<std::uint32_t>(rest.count())};
}
/// Nanoseconds since 1970, or since whatever a simulator counts from.
inline std::int64_t nanoseconds_of(const builtin_interfaces::Time& time) noexcept {
  return time.sec * std::int64_t{1'000'000'000} + time.nanosec;
}

}  // namespace takt

#endif  // TAKT_MESSAGES_PACKAGES_BUILTIN_INTERFACES_HPP_
