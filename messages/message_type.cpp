// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/message_type.hpp"

#include <cstring>
#include <map>
#include <memory>
#include <mutex>

#include "takt/base/never_destroyed.hpp"

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

std::string detail::name_of(FieldShape::Id id) {
  switch (id) {
    case FieldShape::boolean:
      return "boolean";
    case FieldShape::byte:
      return "octet";
    case FieldShape::character:
      return "char";
    case FieldShape::float32:
      return "float";
    case FieldShape::float64:
      return "double";
    case FieldShape::int8:
      return "int8";
    case FieldShape::uint8:
      return "uint8";
    case FieldShape::int16:
      return "int16";
    case FieldShape::uint16:
      return "uint16";
    case FieldShape::int32:
      return "int32";
    case FieldShape::uint32:
      return "uint32";
    case FieldShape::int64:
      return "int64";
    case FieldShape::uint64:
      return "uint64";
    default:
      return {};  // these have names of their own
  }
}

std::string detail::name_of(const MessageType& nested) {
  return nested.name + "#" + std::to_string(nested.layout_hash);
}

std::string detail::name_of_sequence(const std::string& element) {
  return "sequence<" + element + ">";
}

std::string detail::name_of_array(const std::string& element, std::size_t size) {
  return element + "[" + std::to_string(size) + "]";
}

std::string detail::name_of_bounded(const std::string& container, std::size_t most) {
  return "at_most<" + container + "," + std::to_string(most) + ">";
}

detail::FieldDescription::operator MessageField() const {
  return {name, type(), offset, fixed_size(), shape(), {}};
}

const MessageType& detail::make_message_type(std::string_view name, const MessageLayout& layout,
                                             std::initializer_list<FieldDescription> fields) {
  return *new MessageType(finish_message_type({.name = std::string(name),
                                               .fields = {fields.begin(), fields.end()},
                                               .size = layout.size,
                                               .alignment = layout.alignment,
                                               .fixed_size = layout.fixed_size,
                                               .encode = layout.encode,
                                               .decode = layout.decode,
                                               .encode_defaults = layout.encode_defaults}));
}

const MessageType& serialized_type(std::string_view name) {
  static std::mutex mutex;
  static detail::NeverDestroyed<std::map<std::string, MessageType, std::less<>>> all;
  auto& types = *all;
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
