// ROS 2's time and duration, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_MESSAGES_BUILTIN_INTERFACES_HPP_
#define TAKT_TRANSPORT_MESSAGES_BUILTIN_INTERFACES_HPP_

#include <cstdint>

#include "takt/transport/message_type.hpp"

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

#endif  // TAKT_TRANSPORT_MESSAGES_BUILTIN_INTERFACES_HPP_
