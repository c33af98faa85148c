// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/message_type.hpp"

#include <cstring>
#include <map>
#include <memory>
#include <mutex>

namespace takt {

MessageType detail::finish_message_type(MessageType type) {
  // FNV-1a, 64 bits.
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](std::string_view text) {
    for (const char character : text) {
      hash = (hash ^ static_cast<unsigned char>(character)) * 0x100000001b3;
    }
    hash = (hash ^ 0xff) * 0x100000001b3;  // separates words: "ab","c" differs from "a","bc"
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

const MessageType& serialized_type(std::string_view name) {
  static std::mutex mutex;
  static auto& types = *new std::map<std::string, MessageType, std::less<>>;
  const std::lock_guard lock(mutex);
  if (const auto known = types.find(name); known != types.end()) return known->second;
  MessageType type{.name = std::string(name),
                   .fields = {{.name = "bytes", .type = "bytes of " + std::string(name)}},
                   .fixed_size = false,
                   .is_serialized = true,
                   .encode =
                       [](const void* message, ByteBuffer& bytes) {
                         const auto& from =
                             *static_cast<const std::span<const std::byte>*>(message);
                         std::memcpy(bytes.extend(from.size()), from.data(), from.size());
                       },
                   .decode = [](std::span<const std::byte>, void*) { return false; }};
  return types.try_emplace(std::string(name), detail::finish_message_type(std::move(type)))
      .first->second;
}

}  // namespace takt
