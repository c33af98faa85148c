// Values of parameters as YAML has them, on the command line and in files.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_PARAMETER_YAML_HPP_
#define RCLCPP_PARAMETER_YAML_HPP_

#include <string>
#include <vector>

#include "arguments.hpp"

namespace rclcpp::detail {

/// Types follow document::Rules::parameters: `1` is an integer, `1.0` a floating-point number,
/// `"1"` a string, `[1, 2]` a list. Throws RCLInvalidROSArgsError when a list mixes types.
takt::ParameterValue parameter_from_yaml(const std::string& text);
/// Throws RCLInvalidROSArgsError when the file cannot be read, or is no file of parameters.
std::vector<ParameterRule> parameters_from_file(const std::string& path);

}  // namespace rclcpp::detail

#endif  // RCLCPP_PARAMETER_YAML_HPP_
