// ROS 2's message of simulated time, as it is on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_ROSGRAPH_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_ROSGRAPH_MSGS_HPP_

#include <cstdint>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/builtin_interfaces.hpp"

namespace takt::rosgraph_msgs {

struct Clock {
  builtin_interfaces::Time clock;
};
TAKT_MESSAGE(Clock, "rosgraph_msgs/msg/Clock", clock);

}  // namespace takt::rosgraph_msgs

#endif  // TAKT_MESSAGES_PACKAGES_ROSGRAPH_MSGS_HPP_
