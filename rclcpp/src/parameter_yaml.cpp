// SPDX-License-Identifier: Apache-2.0
#include "parameter_yaml.hpp"

#include <optional>
#include <utility>

#include "takt/containers/configuration/parameter_file.hpp"
#include "takt/containers/configuration/system_reader.hpp"

#include "rclcpp/exceptions/exceptions.hpp"

namespace rclcpp::detail {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw exceptions::RCLInvalidROSArgsError("failed to parse parameters: " + what);
}

}  // namespace

takt::ParameterValue parameter_from_yaml(const std::string& text) {
  try {
    takt::document::Errors errors("'" + text + "'");
    const auto value = takt::document::parse_yaml(text, errors, takt::document::Rules::parameters);
    errors.throw_if_any();
    const std::optional<takt::ParameterValue> parameter = takt::read_parameter(value, errors);
    errors.throw_if_any();
    return *parameter;
  } catch (const takt::Error& error) {
    refuse(error.what());
  }
}

std::vector<ParameterRule> parameters_from_file(const std::string& path) {
  try {
    takt::document::Errors errors(path);
    const takt::document::Value file =
        takt::document::read(path, errors, takt::document::Rules::parameters);
    errors.throw_if_any();
    std::vector<ParameterRule> rules;
    for (const auto& section : takt::document::node_parameters(file, errors)) {
      for (const takt::document::Value& value : section.parameters) {
        if (auto parameter = takt::read_parameter(value, errors)) {
          rules.push_back({section.node, value.name, *std::move(parameter)});
        }
      }
    }
    errors.throw_if_any();
    return rules;
  } catch (const takt::Error& error) {
    refuse(error.what());
  }
}

}  // namespace rclcpp::detail
