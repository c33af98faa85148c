// ROS 2's descriptions, hashes, definitions and names of message types.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
#define TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_

#include <optional>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/messages/type_description_interfaces/msg/type_description.hpp"

namespace TAKT_PUBLIC takt {

using TypeDescription = type_description_interfaces::msg::TypeDescription;

/// The only field of types without fields: IDL has no empty structures.
inline constexpr std::string_view kNoFields = "structure_needs_at_least_one_member";

/// The type and all types that it refers to, as REP 2016 describes them and ROS 2's services
/// `get_type_description` exchange them. Empty for a type that ROS 2 cannot have: its name is not
/// of the form "std_msgs/msg/String", or its fields are unknown.
std::optional<TypeDescription> describe(const MessageType& type);
/// A service like "example_interfaces/srv/AddTwoInts", with the event of ROS 2's service
/// introspection.
std::optional<TypeDescription> describe_service(const MessageType& request,
                                                const MessageType& response);
/// An action like "example_interfaces/action/Fibonacci", with the services and messages that ROS 2
/// makes of its three types.
std::optional<TypeDescription> describe_action(const MessageType& goal, const MessageType& result,
                                               const MessageType& feedback);

/// The type hash of REP 2011 and 2016: "RIHS01_" and the SHA-256, in 64 hexadecimal digits, of the
/// description as JSON, without default values.
std::string type_hash(const TypeDescription& description);
/// Of a message or service; empty for a type that ROS 2 cannot have.
std::string type_hash(const MessageType& type);
std::string service_type_hash(const MessageType& request, const MessageType& response);

/// The type as text of a .msg file, including all types that it refers to; recordings contain this
/// text. Empty for a type that ROS 2 cannot have.
std::string message_definition(const MessageType& type);

/// Converts "std_msgs::msg::dds_::String_" to "std_msgs/msg/String"; returns other names unchanged.
std::string ros_type_name(std::string_view dds_name);

}  // namespace takt

#endif  // TAKT_MESSAGES_TYPE_DESCRIPTION_HPP_
