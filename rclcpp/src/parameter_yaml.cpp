// SPDX-License-Identifier: Apache-2.0
#include "parameter_yaml.hpp"

#include <exception>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "takt/base/regular_file.hpp"

#include "rclcpp/exceptions/exceptions.hpp"

namespace rclcpp::detail {
namespace {

// Limit: bytes of a parameter file of rclcpp. At it: the file is refused. Seen: the error.
constexpr std::size_t kMostBytes = std::size_t{1} << 24;

[[noreturn]] void refuse(const std::string& what) {
  throw exceptions::RCLInvalidROSArgsError("failed to parse parameters: " + what);
}

takt::ParameterValue scalar(const YAML::Node& node) {
  if (node.Tag() == "!") return node.Scalar();  // quoted
  if (node.IsNull()) return {};
  if (bool value = false; YAML::convert<bool>::decode(node, value)) return value;
  if (std::int64_t value = 0; YAML::convert<std::int64_t>::decode(node, value)) return value;
  if (double value = 0; YAML::convert<double>::decode(node, value)) return value;
  return node.Scalar();
}

template <class T>
takt::ParameterValue list_of(const YAML::Node& node) {
  std::vector<T> list;
  for (const YAML::Node& item : node) {
    auto value = scalar(item);
    if constexpr (std::is_same_v<T, double>) {  // [1, 2.5]
      if (const auto* integer = std::get_if<std::int64_t>(&value)) {
        value = static_cast<double>(*integer);
      }
    }
    if (!std::holds_alternative<T>(value)) {
      refuse("the items of a list must have one type: " + YAML::Dump(node));
    }
    list.push_back(std::get<T>(std::move(value)));
  }
  return list;
}

takt::ParameterValue value_of(const YAML::Node& node) {
  if (!node.IsSequence()) return scalar(node);
  if (node.size() == 0) return std::vector<std::string>();
  bool has_double = false;
  for (const YAML::Node& item : node) {
    has_double = has_double || std::holds_alternative<double>(scalar(item));
  }
  if (has_double) return list_of<double>(node);
  const auto first = scalar(node[0]);
  if (std::holds_alternative<bool>(first)) return list_of<bool>(node);
  if (std::holds_alternative<std::int64_t>(first)) return list_of<std::int64_t>(node);
  return list_of<std::string>(node);
}

void add_values(const YAML::Node& map, const std::string& node, const std::string& prefix,
                std::vector<ParameterRule>& rules) {
  for (const auto& entry : map) {
    const std::string name = prefix + entry.first.Scalar();
    if (entry.second.IsMap()) {
      add_values(entry.second, node, name + ".", rules);
    } else {
      rules.push_back({node, name, value_of(entry.second)});
    }
  }
}

void add_nodes(const YAML::Node& map, const std::string& path, std::vector<ParameterRule>& rules) {
  if (!map.IsMap()) refuse("'" + path + "' has no ros__parameters");
  for (const auto& entry : map) {
    const std::string key = entry.first.Scalar();
    if (key == "ros__parameters") {
      if (entry.second.IsMap()) add_values(entry.second, path, "", rules);
    } else {
      add_nodes(entry.second, path + "/" + key, rules);
    }
  }
}

}  // namespace

takt::ParameterValue parameter_from_yaml(const std::string& text) {
  try {
    return value_of(YAML::Load(text));
  } catch (const YAML::Exception& exception) {
    refuse("'" + text + "': " + exception.what());
  }
}

std::vector<ParameterRule> parameters_from_file(const std::string& path) {
  try {
    std::vector<ParameterRule> rules;
    add_nodes(YAML::Load(takt::read_text(path, kMostBytes)), "", rules);
    return rules;
  } catch (const std::exception& exception) {
    refuse("file '" + path + "': " + exception.what());
  }
}

}  // namespace rclcpp::detail
