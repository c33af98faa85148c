// What ROS 2 calls the same type: type hashes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
#define TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_

#include <string>
#include <string_view>

#include "takt/messages/message_type.hpp"

namespace takt {

/// The hash of REP 2011 and 2016, "RIHS01_" and 64 hexadecimal digits: SHA-256 of the type's
/// description and of those that it refers to, as JSON. Empty for a type that ROS 2 cannot have:
/// one that is not called like "std_msgs/msg/String", or whose fields are not known.
std::string type_hash(const MessageType& type);
/// Of "example_interfaces/srv/AddTwoInts", from its request and response: a service's description
/// has them as fields, and the event that ROS 2's service introspection sends.
std::string service_type_hash(const MessageType& request, const MessageType& response);

/// The type as the text of a .msg file, with those that it refers to, as recordings have it. Empty
/// for a type that ROS 2 cannot have.
std::string message_definition(const MessageType& type);

/// "std_msgs/msg/String" of "std_msgs::msg::dds_::String_"; other names stay.
std::string ros_type_name(std::string_view dds_name);

}  // namespace takt

#endif  // TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
