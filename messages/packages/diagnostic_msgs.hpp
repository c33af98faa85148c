// ROS 2's diagnostics, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_DIAGNOSTIC_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_DIAGNOSTIC_MSGS_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/std_msgs.hpp"

namespace takt::diagnostic_msgs {

enum class DiagnosticLevel : std::uint8_t { ok = 0, warn = 1, error = 2, stale = 3 };

struct KeyValue {
  std::string key, value;
};
TAKT_MESSAGE(KeyValue, "diagnostic_msgs/msg/KeyValue", key, value);

struct DiagnosticStatus {
  std::byte level{};  // a DiagnosticLevel
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
};
TAKT_MESSAGE(DiagnosticStatus, "diagnostic_msgs/msg/DiagnosticStatus", level, name, message,
             hardware_id, values);

struct DiagnosticArray {
  std_msgs::Header header;
  std::vector<DiagnosticStatus> status;
};
TAKT_MESSAGE(DiagnosticArray, "diagnostic_msgs/msg/DiagnosticArray", header, status);

}  // namespace takt::diagnostic_msgs

#endif  // TAKT_MESSAGES_PACKAGES_DIAGNOSTIC_MSGS_HPP_
