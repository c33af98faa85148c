// Messages of types that the program's code does not name: read, shown, and made from text.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DYNAMIC_MESSAGE_HPP_
#define TAKT_TOOLS_TAKT_DYNAMIC_MESSAGE_HPP_

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/configuration/document.hpp"
#include "takt/messages/message_type.hpp"

namespace takt::tools {

/// ROS 2's types that Takt has, by name; nullptr: it does not know this one.
const MessageType* known_type(std::string_view name);
/// The same, or the Error that tells what is known.
const MessageType& require_type(std::string_view name);

struct ReadOptions {
  std::size_t skipped = 0;      // bytes of header that come first, as in requests and replies
  std::size_t most = SIZE_MAX;  // elements of an array; then a text says how many there are
};
/// The fields of a message in their order. Throws Error when the bytes are no such message.
nlohmann::ordered_json read_message(const MessageType& type, std::span<const std::byte> bytes,
                                    const ReadOptions& options = {});
/// As YAML, indented.
std::string to_yaml(const nlohmann::ordered_json& message);

/// A message from text like "{linear: {x: 1.0}}"; what it leaves out is zero. `header`: comes
/// before the fields. Throws ConfigurationError, or Error, that says which field.
ByteBuffer write_message(const MessageType& type, const std::string& text,
                         std::span<const std::byte> header = {});

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DYNAMIC_MESSAGE_HPP_
