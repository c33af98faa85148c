// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/message_type.hpp"

#include <string_view>

namespace takt {

MessageType finish_message_type(MessageType type) {
  // FNV-1a, 64 bits.
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](std::string_view text) {
    for (const char character : text) {
      hash = (hash ^ static_cast<unsigned char>(character)) * 0x100000001b3;
    }
    hash = (hash ^ 0xff) * 0x100000001b3;  // ends the word: "ab","c" is not "a","bc"
  };
  for (const MessageField& field : type.fields) {
    add(field.name);
    add(field.type);
    add(std::to_string(field.offset));
    type.fixed_size = type.fixed_size && field.fixed_size;
  }
  add(std::to_string(type.size));
  type.layout_hash = hash;
  return type;
}

}  // namespace takt
