// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/type_description.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <openssl/sha.h>

#include "takt/transport/messages/builtin_interfaces.hpp"

namespace takt {
namespace {

/// A field, and a structure of fields, as their description's JSON has them.
struct Field {
  std::string name;
  FieldShape shape;
  std::string nested;  // the name of shape.type, or of one that only exists as a description
};
using Structures = std::map<std::string, std::vector<Field>>;

bool is_ros_name(std::string_view name) {
  return std::count(name.begin(), name.end(), '/') == 2;
}

// Adds the type, and those that it refers to. False: one of them is unknown to ROS 2.
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
    fields.push_back({"structure_needs_at_least_one_member", {FieldShape::uint8}, {}});
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
      !request.name.ends_with(kRequest) ||
      !add(structures, message_type<builtin_interfaces::Time>())) {
    return {};
  }
  const std::string name = request.name.substr(0, request.name.size() - kRequest.size());
  const std::string event = name + "_Event", info = "service_msgs/msg/ServiceEventInfo";
  structures[info] = {
      {"event_type", {FieldShape::uint8}, {}},
      {"stamp", {FieldShape::nested}, "builtin_interfaces/msg/Time"},
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
