// ROS 2's type hashes, definitions and names of message types.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
#define TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_

#include <string>
#include <string_view>

#include "takt/messages/message_type.hpp"

namespace takt {

/// The type hash of REP 2011 and 2016: "RIHS01_" and the SHA-256, in 64 hexadecimal digits, of the
/// JSON description of the type and all types that it refers to. Empty for a type that ROS 2 cannot
/// have: its name is not of the form "std_msgs/msg/String", or its fields are unknown.
std::string type_hash(const MessageType& type);
/// The type hash of a service like "example_interfaces/srv/AddTwoInts". Its description contains
/// the request, the response, and the event of ROS 2's service introspection.
std::string service_type_hash(const MessageType& request, const MessageType& response);

/// The type as text of a .msg file, including all types that it refers to; recordings contain this
/// text. Empty for a type that ROS 2 cannot have.
std::string message_definition(const MessageType& type);

/// Converts "std_msgs::msg::dds_::String_" to "std_msgs/msg/String"; returns other names unchanged.
std::string ros_type_name(std::string_view dds_name);

}  // namespace takt

#endif  // TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
