// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/type_description.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <openssl/sha.h>

namespace takt {
namespace {

/// A field, and a structure of fields, in the form of the JSON description.
struct Field {
  std::string name;
  FieldShape shape;
  std::string nested;  // the name of shape.type, or of one that only exists as a description
};
// IDL has no empty structures, so ROS 2 adds this field.
constexpr const char* kNoFields = "structure_needs_at_least_one_member";
using Structures = std::map<std::string, std::vector<Field>>;

bool is_ros_name(std::string_view name) {
  return std::count(name.begin(), name.end(), '/') == 2;
}

// Adds the type and all types that it refers to. Returns false if ROS 2 does not know one of them.
bool add(Structures& structures, const MessageType& type) {
  if (!is_ros_name(type.name)) return false;
  const auto [entry, is_new] = structures.try_emplace(type.name);
  if (!is_new) return true;
  std::vector<Field> fields;
  for (const MessageField& field : type.fields) {
    if (field.shape.id == 0) return false;
    const MessageType* nested = field.shape.type;
    if (nested != nullptr && !add(structures, *nested)) return false;
    fields.push_back({field.name, field.shape, nested != nullptr ? nested->name : ""});
  }
  if (fields.empty()) {
    fields.push_back({kNoFields, {FieldShape::uint8}, {}});
  }
  structures[type.name] = std::move(fields);
  return true;
}

std::string json(const std::string& name, const std::vector<Field>& fields) {
  std::string result = fmt::format(R"({{"type_name": "{}", "fields": [)", name);
  const char* separator = "";
  for (const Field& field : fields) {
    result += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
        std::exchange(separator, ", "), field.name, field.shape.id, field.shape.capacity,
        field.shape.string_capacity, field.nested);
  }
  return result + "]}";
}

std::string hash(const std::string& name, const Structures& structures) {
  std::string text = fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [)",
                                 json(name, structures.at(name)));
  const char* separator = "";
  for (const auto& [other, fields] : structures) {
    if (other != name) text += std::exchange(separator, ", ") + json(other, fields);
  }
  text += "]}";
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  return fmt::format("RIHS01_{:02x}", fmt::join(digest, ""));
}

// "std_msgs/msg/Header" is "std_msgs/Header" in a definition.
std::string short_name(const std::string& name) {
  return name.substr(0, name.find('/')) + name.substr(name.rfind('/'));
}

/// The type of the field, or of its elements, as a `.msg` file names it.
std::string element_type(const Field& field) {
  switch (field.shape.element()) {
    case FieldShape::nested:
      return short_name(field.nested);
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
    case FieldShape::float32:
      return "float32";
    case FieldShape::float64:
      return "float64";
    case FieldShape::character:
      return "char";
    case FieldShape::boolean:
      return "bool";
    case FieldShape::byte:
      return "byte";
    case FieldShape::string:
      return "string";
    case FieldShape::bounded_string:
      return fmt::format("string<={}", field.shape.string_capacity);
  }
  return {
  }
}

}  // namespace

std::string type_hash(const MessageType& type) {
  Structures structures;
  return add(structures, type) ? hash(type.name, structures) : "";
}

std::string service_type_hash(const MessageType& request, const MessageType& response) {
  constexpr std::string_view kRequest = "_Request";
  constexpr auto kBounded =
      static_cast<std::uint8_t>(FieldShape::nested + FieldShape::kBoundedSequence);
  Structures structures;
  if (!add(structures, request) || !add(structures, response) ||
      !request.name.ends_with(kRequest)) {
    return {};
  }
  const std::string name = request.name.substr(0, request.name.size() - kRequest.size());
  const std::string event = name + "_Event", info = "service_msgs/msg/ServiceEventInfo",
                    time = "builtin_interfaces/msg/Time";
  structures[time] = {{"sec", {FieldShape::int32}, {}}, {"nanosec", {FieldShape::uint32}, {}}};
  structures[info] = {
      {"event_type", {FieldShape::uint8}, {}},
      {"stamp", {FieldShape::nested}, time},
      {"client_gid", {FieldShape::uint8 + FieldShape::kArray, 16}, {}},
      {"sequence_number", {FieldShape::int64}, {}},
  };
  structures[event] = {
      {"info", {FieldShape::nested}, info},
      {"request", {kBounded, 1}, request.name},
      {"response", {kBounded, 1}, response.name},
  };
  structures[name] = {
      {"request_message", {FieldShape::nested}, request.name},
      {"response_message", {FieldShape::nested}, response.name},
      {"event_message", {FieldShape::nested}, event},
  };
  return hash(name, structures);
}

std::string message_definition(const MessageType& type) {
  Structures structures;
  if (!add(structures, type)) return {};
  const auto text_of = [&](const std::vector<Field>& fields) {
    std::string text;
    for (const Field& field : fields) {
      if (field.name == kNoFields) continue;
      std::string count;
      if (field.shape.is_array()) count = fmt::format("[{}]", field.shape.capacity);
      if (field.shape.is_sequence()) {
        count = field.shape.capacity == 0 ? "[]" : fmt::format("[<={}]", field.shape.capacity);
      }
      text += fmt::format("{}{} {}\n", element_type(field), count, field.name);
    }
    return text;
  };
  std::string text = text_of(structures.at(type.name));
  for (const auto& [name, fields] : structures) {
    if (name == type.name) continue;
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", short_name(name), text_of(fields));
  }
  return text;
}

std::string ros_type_name(std::string_view dds_name) {
  constexpr std::string_view kMark = "::dds_::";
  const std::size_t mark = dds_name.find(kMark);
  if (mark == std::string_view::npos || !dds_name.ends_with('_')) return std::string(dds_name);
  const std::string_view space = dds_name.substr(0, mark);  // "std_msgs::msg"
  dds_name.remove_prefix(mark + kMark.size());
  dds_name.remove_suffix(1);
  const std::size_t colons = space.find("::");
  if (colons == std::string_view::npos) return fmt::format("{}/{}", space, dds_name);
  return fmt::format("{}/{}/{}", space.substr(0, colons), space.substr(colons + 2), dds_name);
}

}  // namespace takt
