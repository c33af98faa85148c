// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/parameter.hpp"

#include <array>
#include <sstream>
#include <utility>

#include "takt/ros2/parameter_services.hpp"

namespace rclcpp {

std::string to_string(ParameterType type) {
  constexpr std::array kNames = {"not set",      "bool",        "integer",    "double",
                                 "string",       "byte_array",  "bool_array", "integer_array",
                                 "double_array", "string_array"};
  return type < kNames.size() ? kNames[type] : "unknown type";
}
std::ostream& operator<<(std::ostream& stream, ParameterType type) {
  return stream << to_string(type);
}

ParameterValue::ParameterValue(const rcl_interfaces::msg::ParameterValue& message)
    : value_(takt::from_message(message)) {
}
rcl_interfaces::msg::ParameterValue ParameterValue::to_value_msg() const {
  return takt::to_message(value_);
}

namespace {

struct Text {
  std::string operator()(std::monostate) const { return "not set"; }
  std::string operator()(bool item) const { return item ? "true" : "false"; }
  std::string operator()(std::int64_t item) const { return std::to_string(item); }
  std::string operator()(double item) const { return std::to_string(item); }
  std::string operator()(const std::string& item) const { return item; }
  template <class Item>
  std::string operator()(const std::vector<Item>& items) const {
    constexpr bool kIsBytes = std::is_same_v<Item, std::uint8_t>;
    std::ostringstream text;
    text << std::boolalpha << std::showbase << (kIsBytes ? std::hex : std::dec);
    const char* separator = "[";
    for (const auto& item : items) {
      text << std::exchange(separator, ", ");
      if constexpr (kIsBytes) {
        text << int{item};
      } else {
        text << item;
      }
    }
    return items.empty() ? "[]" : text.str() + "]";
  }
};

}  // namespace

std::string to_string(const ParameterValue& value) {
  return std::visit(Text(), value.to_takt());
}

Parameter Parameter::from_parameter_msg(const rcl_interfaces::msg::Parameter& message) {
  return {message.name, ParameterValue(message.value)};
}
rcl_interfaces::msg::Parameter Parameter::to_parameter_msg() const {
  rcl_interfaces::msg::Parameter message;
  message.name = name_;
  message.value = get_value_message();
  return message;
}

std::string to_string(const Parameter& parameter) {
  return R"({"name": ")" + parameter.get_name() + R"(", "type": ")" + parameter.get_type_name() +
         R"(", "value": ")" + parameter.value_to_string() + "\"}";
}
std::string to_string(const std::vector<Parameter>& parameters) {
  std::string text = "{";
  for (const Parameter& parameter : parameters) {
    if (text.size() > 1) text += ", ";
    text += '"' + parameter.get_name() + "\": " + to_string(parameter);
  }
  return text + "}";
}
std::ostream& operator<<(std::ostream& stream, const Parameter& parameter) {
  return stream << to_string(parameter);
}
std::ostream& operator<<(std::ostream& stream, const std::vector<Parameter>& parameters) {
  return stream << to_string(parameters);
}

}  // namespace rclcpp
