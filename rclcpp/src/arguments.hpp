// What a command line says after `--ros-args`.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ARGUMENTS_HPP_
#define RCLCPP_ARGUMENTS_HPP_

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/nodes/parameter.hpp"

namespace rclcpp::detail {

struct RemapRule {
  enum class Kind { any, topic, service, node_name, name_space };
  Kind kind = Kind::any;
  std::string node;  // whose rule it is; empty: every node's
  std::string from, to;
};
struct ParameterRule {
  std::string node;  // a pattern: "/**", "/front/camera"
  std::string name;
  takt::ParameterValue value;
};

struct Arguments {
  std::vector<RemapRule> remaps;
  std::vector<ParameterRule> parameters;
  std::map<std::string, int> levels;  // of loggers; "": of all others
  bool rosout = true;
  std::vector<std::string> rest;  // which are not ROS's
};

/// Letters, digits and '_', not beginning with a digit.
bool is_token(std::string_view text);
/// "/a/b", of tokens; the root is none.
bool is_path(std::string_view text);

/// Throws UnknownROSArgsError or RCLInvalidROSArgsError.
Arguments parse_arguments(const std::vector<std::string>& arguments);

/// The first rule of `own`, then of `all`, which applies to this node and this kind.
const RemapRule* find_rule(const Arguments& own, const Arguments& all, RemapRule::Kind kind,
                           std::string_view node);
/// A name of a topic or service with all its namespaces, and without "~" and "{node}".
std::string expand_name(const std::string& name, const std::string& node,
                        const std::string& name_space);
/// After the first rule that matches this expanded name.
std::string remap_name(const Arguments& own, const Arguments& all, const std::string& expanded,
                       bool is_service, const std::string& node, const std::string& name_space);
/// Whether "/**" and the like mean this node.
bool means_node(const std::string& pattern, const std::string& full_name);

}  // namespace rclcpp::detail

#endif  // RCLCPP_ARGUMENTS_HPP_
