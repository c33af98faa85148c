// ROS 2's parameter files: the parameters of nodes, by the nodes' names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PARAMETER_FILE_HPP_
#define TAKT_TOOLS_TAKT_PARAMETER_FILE_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/configuration/parameter_file.hpp"

namespace takt::tools {

/// Adds the parameter "a.b" as {"a": {"b": value}}.
void add_parameter(nlohmann::ordered_json& parameters, const std::string& name,
                   nlohmann::ordered_json value);

/// The parameters, with their full names, of the sections that are for this node. Those with the
/// node's name override those with wildcards. Adds an error if no section is for the node.
std::vector<document::Value> parameters_of(const document::Value& file, const std::string& node,
                                           document::Errors& errors);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PARAMETER_FILE_HPP_
