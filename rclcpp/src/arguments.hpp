// Parses the arguments after `--ros-args`.
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
  std::string node;  // the node that the rule is for; empty: every node
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
  std::map<std::string, int> levels;  // by the name of the logger; "": the root logger
  bool rosout = true;
  std::vector<std::string> rest;  // the non-ROS arguments
};

/// Letters, digits and '_', not beginning with a digit.
bool is_token(std::string_view text);
/// Whether the text is a path of tokens such as "/a/b"; "/" is not.
bool is_path(std::string_view text);

/// Throws UnknownROSArgsError or RCLInvalidROSArgsError.
Arguments parse_arguments(const std::vector<std::string>& arguments);

/// The first rule for this node and kind; the rules of `own` come before those of `all`.
const RemapRule* find_rule(const Arguments& own, const Arguments& all, RemapRule::Kind kind,
                           std::string_view node);
/// The full name of a topic or service: a relative name gets its namespace, and "~" and "{node}"
/// are replaced.
std::string expand_name(const std::string& name, const std::string& node,
                        const std::string& name_space);
/// The name after the first remap rule that matches this expanded name.
std::string remap_name(const Arguments& own, const Arguments& all, const std::string& expanded,
                       bool is_service, const std::string& node, const std::string& name_space);
/// Whether the node pattern of a parameter rule, such as "/**", matches this node.
bool means_node(const std::string& pattern, const std::string& full_name);

}  // namespace rclcpp::detail

#endif  // RCLCPP_ARGUMENTS_HPP_
