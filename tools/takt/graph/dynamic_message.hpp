// Messages of types that are only known at run time: decodes, prints and encodes them.
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

struct ReadOptions {
  std::size_t skipped = 0;      // bytes before the fields: the header of requests and replies
  std::size_t most = SIZE_MAX;  // array elements to decode; a text replaces the rest
  bool bytes_as_text = false;   // a `byte` is a character, as in what `ros2 topic echo` prints
};
/// Decodes the fields of a message. Throws Error if the bytes are not a message of this type.
nlohmann::ordered_json read_message(const MessageType& type, std::span<const std::byte> bytes,
                                    const ReadOptions& options = {});
/// Formats fields as indented YAML.
std::string to_yaml(const nlohmann::ordered_json& message);

/// Encodes a message from text like "{linear: {x: 1.0}}"; missing fields have the
/// defaults of their type. `header`
/// precedes the fields. Throws ConfigurationError or Error, which names the invalid field.
ByteBuffer write_message(const MessageType& type, const std::string& text,
                         std::span<const std::byte> header = {});

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DYNAMIC_MESSAGE_HPP_
