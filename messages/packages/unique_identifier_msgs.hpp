// ROS 2's identifier of 16 bytes, as it is on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_UNIQUE_IDENTIFIER_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_UNIQUE_IDENTIFIER_MSGS_HPP_

#include <array>
#include <cstdint>

#include "takt/messages/message_type.hpp"

namespace takt::unique_identifier_msgs {

struct UUID {
  std::array<std::uint8_t, 16> uuid{};
};
TAKT_MESSAGE(UUID, "unique_identifier_msgs/msg/UUID", uuid);

}  // namespace takt::unique_identifier_msgs

#endif  // TAKT_MESSAGES_PACKAGES_UNIQUE_IDENTIFIER_MSGS_HPP_
