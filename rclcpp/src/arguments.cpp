// SPDX-License-Identifier: Apache-2.0
#include "arguments.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "takt/containers/configuration/parameter_file.hpp"

#include "parameter_yaml.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/logger.hpp"

namespace rclcpp::detail {
namespace {

[[noreturn]] void refuse(const std::string& argument, const std::string& why) {
  throw exceptions::RCLInvalidROSArgsError("failed to parse ROS argument '" + argument +
                                           "': " + why);
}

/// "left:=right"
std::pair<std::string, std::string> split_rule(const std::string& rule) {
  const auto at = rule.find(":=");
  if (at == std::string::npos || at == 0) refuse(rule, "it must be FROM:=TO");
  return {rule.substr(0, at), rule.substr(at + 2)};
}

/// Removes "NODE:" from the front and returns NODE, or "" if the rule is for every node. The colon
/// of "rostopic://" does not count.
std::string take_node(std::string& name) {
  const auto colon = name.find(':');
  if (colon == std::string::npos || name.compare(colon, 3, "://") == 0) return {};
  std::string node = name.substr(0, colon);
  if (!is_token(node)) refuse(name, "before ':' must be the name of a node");
  name.erase(0, colon + 1);
  return node;
}

/// Whether a rule can name a topic or service like this: "/a/b", "a/b" or "~/a".
bool is_name_in_rule(std::string_view name) {
  if (name.starts_with("~/")) name.remove_prefix(1);
  return is_path(name.starts_with('/') ? std::string(name) : "/" + std::string(name));
}

RemapRule parse_remap(const std::string& text) {
  auto [from, to] = split_rule(text);
  RemapRule rule;
  constexpr std::pair<std::string_view, RemapRule::Kind> kSchemes[] = {
      {"rostopic://", RemapRule::Kind::topic}, {"rosservice://", RemapRule::Kind::service}};
  rule.node = take_node(from);
  for (const auto& [scheme, kind] : kSchemes) {
    if (!from.starts_with(scheme)) continue;
    rule.kind = kind;
    from.erase(0, scheme.size());
  }
  if (from == "__node" || from == "__name") {
    rule.kind = RemapRule::Kind::node_name;
    if (!is_token(to)) refuse(text, "'" + to + "' cannot be the name of a node");
  } else if (from == "__ns") {
    rule.kind = RemapRule::Kind::name_space;
    if (to != "/" && !is_path(to)) refuse(text, "a namespace must be '/', or '/a/b'");
  } else {
    for (const std::string& name : {from, to}) {
      if (!is_name_in_rule(name)) refuse(text, "'" + name + "' cannot be the name of a topic");
    }
  }
  rule.from = std::move(from);
  rule.to = std::move(to);
  return rule;
}

ParameterRule parse_parameter(const std::string& text) {
  auto [name, value] = split_rule(text);
  ParameterRule rule{.node = take_node(name), .name = {}, .value = {}};
  if (rule.node.empty()) rule.node = "/**";
  if (name.empty()) refuse(text, "there is no name before ':='");
  rule.name = std::move(name);
  rule.value = parameter_from_yaml(value);
  return rule;
}

void parse_level(const std::string& text, Arguments& arguments) {
  const auto at = text.find(":=");
  if (at == 0) refuse(text, "there is no name of a logger before ':='");
  const std::string logger = at == std::string::npos ? "" : text.substr(0, at);
  std::string level = at == std::string::npos ? text : text.substr(at + 2);
  std::transform(level.begin(), level.end(), level.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::pair<std::string_view, Logger::Level> kLevels[] = {
      {"debug", Logger::Level::Debug}, {"info", Logger::Level::Info},
      {"warn", Logger::Level::Warn},   {"error", Logger::Level::Error},
      {"fatal", Logger::Level::Fatal}, {"unset", Logger::Level::Unset}};
  for (const auto& [name, value] : kLevels) {
    if (name == level) {
      arguments.levels[logger] = static_cast<int>(value);
      return;
    }
  }
  refuse(text, "it is no log level");
}

/// Parses a flag that takes a value; false if `flag` is none of these. `value`: nullptr if `flag`
/// is the last argument.
bool parse_with_value(const std::string& flag, const std::string* value, Arguments& arguments) {
  constexpr std::string_view kIgnored[] = {"--log-config-file", "--log-file-name", "-e",
                                           "--enclave"};
  const auto is = [&](std::string_view brief, std::string_view name) {
    if (flag != brief && flag != name) return false;
    if (value == nullptr) refuse(flag, "nothing follows it");
    return true;
  };
  if (is("-r", "--remap")) {
    arguments.remaps.push_back(parse_remap(*value));
  } else if (is("-p", "--param")) {
    arguments.parameters.push_back(parse_parameter(*value));
  } else if (is("--params-file", "--params-file")) {
    const auto rules = parameters_from_file(*value);
    arguments.parameters.insert(arguments.parameters.end(), rules.begin(), rules.end());
  } else if (is("--log-level", "--log-level")) {
    parse_level(*value, arguments);
  } else {
    return std::any_of(std::begin(kIgnored), std::end(kIgnored),
                       [&](std::string_view name) { return is(name, name); });
  }
  return true;
}

bool parse_switch(const std::string& flag, Arguments& arguments) {
  constexpr std::string_view kKnown[] = {"rosout-logs", "stdout-logs", "external-lib-logs"};
  for (const std::string_view prefix : {"--enable-", "--disable-"}) {
    if (!flag.starts_with(prefix)) continue;
    const std::string name = flag.substr(prefix.size());
    if (name == "rosout-logs") arguments.rosout = prefix == "--enable-";
    return std::find(std::begin(kKnown), std::end(kKnown), name) != std::end(kKnown);
  }
  return false;
}

}  // namespace

bool is_token(std::string_view text) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9');
  });
}
bool is_path(std::string_view text) {
  if (!text.starts_with('/')) return false;
  text.remove_prefix(1);
  for (;;) {
    const auto end = std::min(text.find('/'), text.size());
    if (!is_token(text.substr(0, end))) return false;
    if (end == text.size()) return true;
    text.remove_prefix(end + 1);
  }
}

Arguments parse_arguments(const std::vector<std::string>& arguments) {
  Arguments result;
  std::vector<std::string> unknown;
  bool is_ros = false;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (!is_ros || argument == "--ros-args") {
      is_ros = is_ros || argument == "--ros-args";
      if (!is_ros) result.rest.push_back(argument);
    } else if (argument == "--") {
      is_ros = false;
    } else if (parse_switch(argument, result)) {
      continue;
    } else if (parse_with_value(argument, i + 1 < arguments.size() ? &arguments[i + 1] : nullptr,
                                result)) {
      ++i;
    } else {
      unknown.push_back(argument);
    }
  }
  if (!unknown.empty()) throw exceptions::UnknownROSArgsError(std::move(unknown));
  return result;
}

const RemapRule* find_rule(const Arguments& own, const Arguments& all, RemapRule::Kind kind,
                           std::string_view node) {
  for (const auto* rules : {&own.remaps, &all.remaps}) {
    for (const RemapRule& rule : *rules) {
      if (rule.kind == kind && (rule.node.empty() || rule.node == node)) return &rule;
    }
  }
  return nullptr;
}

std::string expand_name(const std::string& name, const std::string& node,
                        const std::string& name_space) {
  std::string expanded = name;
  const std::string prefix = name_space == "/" ? "" : name_space;
  for (const auto& [key, value] : {std::pair<std::string, std::string>{"{node}", node},
                                   {"{ns}", prefix},
                                   {"{namespace}", prefix}}) {
    for (auto at = expanded.find(key); at != std::string::npos; at = expanded.find(key)) {
      expanded.replace(at, key.size(), value);
    }
  }
  if (expanded.starts_with('~')) {
    expanded = prefix + "/" + node + expanded.substr(1);
  } else if (!expanded.starts_with('/')) {
    expanded = prefix + "/" + expanded;
  }
  return expanded;
}

std::string remap_name(const Arguments& own, const Arguments& all, const std::string& expanded,
                       bool is_service, const std::string& node, const std::string& name_space) {
  const auto other = is_service ? RemapRule::Kind::topic : RemapRule::Kind::service;
  for (const auto* rules : {&own.remaps, &all.remaps}) {
    for (const RemapRule& rule : *rules) {
      if (rule.kind == other || rule.kind == RemapRule::Kind::node_name ||
          rule.kind == RemapRule::Kind::name_space) {
        continue;
      }
      if (!rule.node.empty() && rule.node != node) continue;
      if (expand_name(rule.from, node, name_space) == expanded) {
        return expand_name(rule.to, node, name_space);
      }
    }
  }
  return expanded;
}

bool means_node(const std::string& pattern, const std::string& full_name) {
  const char* slash = pattern.starts_with('/') ? "" : "/";
  return takt::document::is_for_node(slash + pattern, full_name);
}

}  // namespace rclcpp::detail
