// ROS 2's time in messages, from and to clocks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_WIRE_TIME_HPP_
#define TAKT_ROS2_WIRE_TIME_HPP_

#include <chrono>
#include <cstdint>

#include "takt/base/visibility.hpp"
#include "takt/messages/builtin_interfaces/msg/time.hpp"

namespace TAKT_PUBLIC takt {

/// Time since 1970, as ROS 2 sends it.
inline builtin_interfaces::msg::Time wire_time(
    std::chrono::system_clock::time_point time) noexcept {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const auto rest = std::chrono::duration_cast<std::chrono::nanoseconds>(time - seconds);
  return builtin_interfaces::msg::Time()
      .set__sec(static_cast<std::int32_t>(seconds.time_since_epoch().count()))
      .set__nanosec(static_cast<std::uint32_t>(rest.count()));
}
/// Nanoseconds since 1970, or since whatever a simulator counts from.
inline std::int64_t nanoseconds_of(const builtin_interfaces::msg::Time& time) noexcept {
  return time.sec * std::int64_t{1'000'000'000} + time.nanosec;
}

}  // namespace takt

#endif  // TAKT_ROS2_WIRE_TIME_HPP_
