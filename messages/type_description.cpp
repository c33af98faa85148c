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

namespace wire = type_description_interfaces::msg;

using Fields = std::vector<wire::Field>;
using Structures = std::map<std::string, Fields>;

constexpr std::size_t kLongestName = decltype(wire::FieldType::nested_type_name)::max_size();
constexpr auto kBounded =
    static_cast<std::uint8_t>(FieldShape::nested + FieldShape::kBoundedSequence);
constexpr auto kUuid = "unique_identifier_msgs/msg/UUID", kTime = "builtin_interfaces/msg/Time",
               kEventInfo = "service_msgs/msg/ServiceEventInfo";

wire::Field field(const std::string& name, std::uint8_t id, const std::string& nested = {},
                  std::size_t capacity = 0, std::size_t string_capacity = 0) {
  return wire::Field().set__name(name).set__type(wire::FieldType()
                                                     .set__type_id(id)
                                                     .set__capacity(capacity)
                                                     .set__string_capacity(string_capacity)
                                                     .set__nested_type_name(nested));
}
wire::Field field(const std::string& name, const std::string& nested) {
  return field(name, FieldShape::nested, nested);
}

bool is_ros_name(std::string_view name) {
  return std::count(name.begin(), name.end(), '/') == 2 && name.size() <= kLongestName;
}

// Adds the type and all types that it refers to. Returns false if ROS 2 does not know one of them.
bool add(Structures& structures, const MessageType& type) {
  if (!is_ros_name(type.name)) return false;
  const auto [entry, is_new] = structures.try_emplace(type.name);
  if (!is_new) return true;
  Fields fields;
  for (const MessageField& known : type.fields) {
    const FieldShape& shape = known.shape;
    if (shape.id == 0) return false;
    if (shape.type != nullptr && !add(structures, *shape.type)) return false;
    fields.push_back(field(known.name, shape.id, shape.type != nullptr ? shape.type->name : "",
                           shape.capacity, shape.string_capacity));
  }
  if (fields.empty()) fields.push_back(field(std::string(kNoFields), FieldShape::uint8));
  structures[type.name] = std::move(fields);
  return true;
}

// The service of a request and a response that are there already.
void add_service(Structures& structures, const std::string& name) {
  const std::string request = name + "_Request", response = name + "_Response",
                    event = name + "_Event";
  structures[kTime] = {field("sec", FieldShape::int32), field("nanosec", FieldShape::uint32)};
  structures[kEventInfo] = {field("event_type", FieldShape::uint8), field("stamp", kTime),
                            field("client_gid", FieldShape::uint8 + FieldShape::kArray, {}, 16),
                            field("sequence_number", FieldShape::int64)};
  structures[event] = {field("info", kEventInfo), field("request", kBounded, request, 1),
                       field("response", kBounded, response, 1)};
  structures[name] = {field("request_message", request), field("response_message", response),
                      field("event_message", event)};
}

TypeDescription to_message(const std::string& name, const Structures& structures) {
  TypeDescription description;
  for (const auto& [type, fields] : structures) {
    auto& place = type == name ? description.type_description
                               : description.referenced_type_descriptions.emplace_back();
    place.set__type_name(type).set__fields(fields);
  }
  return description;
}

std::string json(const wire::IndividualTypeDescription& type) {
  std::string result = fmt::format(R"({{"type_name": "{}", "fields": [)", type.type_name.get());
  const char* separator = "";
  for (const wire::Field& field : type.fields) {
    result += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
        std::exchange(separator, ", "), field.name, field.type.type_id, field.type.capacity,
        field.type.string_capacity, field.type.nested_type_name.get());
  }
  return result + "]}";
}

// "std_msgs/msg/Header" is "std_msgs/Header" in a definition.
std::string short_name(const std::string& name) {
  return name.substr(0, name.find('/')) + name.substr(name.rfind('/'));
}

/// The type of the field, or of its elements, as a `.msg` file names it.
std::string element_type(const wire::FieldType& type) {
  switch (FieldShape{type.type_id}.element()) {
    case FieldShape::nested:
      return short_name(type.nested_type_name.get());
    case FieldShape::float32:
      return "float32";
    case FieldShape::float64:
      return "float64";
    case FieldShape::boolean:
      return "bool";
    case FieldShape::byte:
      return "byte";
    case FieldShape::string:
      return "string";
    case FieldShape::wide_string:
      return "wstring";
    case FieldShape::bounded_string:
      return fmt::format("string<={}", type.string_capacity);
    case FieldShape::bounded_wide_string:
      return fmt::format("wstring<={}", type.string_capacity);
    default:
      return detail::name_of(FieldShape{type.type_id}.element());  // as in IDL
  }
}

// By the functions that OpenSSL calls old: those in their place first load its providers, two
// megabytes of a process.
std::array<unsigned char, SHA256_DIGEST_LENGTH> sha256(const std::string& text) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  SHA256_CTX state;
  SHA256_Init(&state);
  SHA256_Update(&state, text.data(), text.size());
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256_Final(digest.data(), &state);
#pragma GCC diagnostic pop
  return digest;
}

}  // namespace

std::optional<TypeDescription> describe(const MessageType& type) {
  Structures structures;
  if (!add(structures, type)) return std::nullopt;
  return to_message(type.name, structures);
}

std::optional<TypeDescription> describe_service(const MessageType& request,
                                                const MessageType& response) {
  constexpr std::string_view kRequest = "_Request";
  Structures structures;
  if (!add(structures, request) || !add(structures, response) ||
      !request.name.ends_with(kRequest)) {
    return std::nullopt;
  }
  const std::string name = request.name.substr(0, request.name.size() - kRequest.size());
  add_service(structures, name);
  return to_message(name, structures);
}

std::optional<TypeDescription> describe_action(const MessageType& goal, const MessageType& result,
                                               const MessageType& feedback) {
  constexpr std::string_view kGoal = "_Goal";
  Structures structures;
  if (!add(structures, goal) || !add(structures, result) || !add(structures, feedback) ||
      !goal.name.ends_with(kGoal)) {
    return std::nullopt;
  }
  const std::string name = goal.name.substr(0, goal.name.size() - kGoal.size());
  const std::string send = name + "_SendGoal", get = name + "_GetResult",
                    progress = name + "_FeedbackMessage";
  structures[kUuid] = {field("uuid", FieldShape::uint8 + FieldShape::kArray, {}, 16)};
  structures[send + "_Request"] = {field("goal_id", kUuid), field("goal", goal.name)};
  structures[send + "_Response"] = {field("accepted", FieldShape::boolean), field("stamp", kTime)};
  structures[get + "_Request"] = {field("goal_id", kUuid)};
  structures[get + "_Response"] = {field("status", FieldShape::int8), field("result", result.name)};
  structures[progress] = {field("goal_id", kUuid), field("feedback", feedback.name)};
  add_service(structures, send);
  add_service(structures, get);
  structures[name] = {field("goal", goal.name),         field("result", result.name),
                      field("feedback", feedback.name), field("send_goal_service", send),
                      field("get_result_service", get), field("feedback_message", progress)};
  return to_message(name, structures);
}

std::string type_hash(const TypeDescription& description) {
  std::string text = fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [)",
                                 json(description.type_description));
  const char* separator = "";
  for (const auto& other : description.referenced_type_descriptions) {
    text += std::exchange(separator, ", ") + json(other);
  }
  text += "]}";
  return fmt::format("RIHS01_{:02x}", fmt::join(sha256(text), ""));
}

std::string type_hash(const MessageType& type) {
  const auto description = describe(type);
  return description ? type_hash(*description) : "";
}

std::string service_type_hash(const MessageType& request, const MessageType& response) {
  const auto description = describe_service(request, response);
  return description ? type_hash(*description) : "";
}

std::string message_definition(const MessageType& type) {
  Structures structures;
  if (!add(structures, type)) return {};
  const auto text_of = [&](const Fields& fields) {
    std::string text;
    for (const wire::Field& field : fields) {
      if (field.name == kNoFields) continue;
      const FieldShape shape{field.type.type_id};
      std::string count;
      if (shape.is_array()) count = fmt::format("[{}]", field.type.capacity);
      if (shape.is_sequence()) {
        count = field.type.capacity == 0 ? "[]" : fmt::format("[<={}]", field.type.capacity);
      }
      text += fmt::format("{}{} {}\n", element_type(field.type), count, field.name);
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
