// ROS 2's parameter files: the parameters of nodes, by the nodes' names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_PARAMETER_FILE_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_PARAMETER_FILE_HPP_

#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/document.hpp"

namespace takt {
namespace TAKT_INTERNAL document {

/// The key of a node's parameters.
inline constexpr const char* kRosParameters = "ros__parameters";

/// A section of a parameter file.
struct NodeParameters {
  std::string node;  // "/front/lidar"; `*` is any one name, `**` any number of them
  int line = 1;
  std::vector<Value> parameters;  // with their full names; of duplicates, the last counts

  bool is_wildcard() const { return node.find('*') != std::string::npos; }
};

/// The sections of a file that was read by Rules::parameters. Adds an error for a name that no node
/// can have, and for a key without a node's name.
std::vector<NodeParameters> node_parameters(const Value& file, Errors& errors);
/// Whether a section's name means this node. Both are absolute.
bool is_for_node(std::string_view pattern, std::string_view node);
/// The parameters, with their full names, of the sections that are for this node. Those with the
/// node's name override those with wildcards. Adds an error if no section is for the node.
std::vector<Value> parameters_of(const Value& file, const std::string& node, Errors& errors);

/// Whether the file has the key `ros__parameters`, which no configuration file has.
bool is_parameter_file(const Value& root);

}  // namespace document
}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_PARAMETER_FILE_HPP_
