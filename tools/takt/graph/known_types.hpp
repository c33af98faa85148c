// The message types that are part of the program.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_KNOWN_TYPES_HPP_
#define TAKT_TOOLS_TAKT_KNOWN_TYPES_HPP_

#include <string_view>

#include "takt/messages/message_type.hpp"

namespace takt::tools {

/// The ROS 2 type with this name; nullptr if Takt does not know it.
const MessageType* known_type(std::string_view name);
/// Throws an Error that lists the known types.
[[noreturn]] void throw_unknown_type(std::string_view name);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_KNOWN_TYPES_HPP_
