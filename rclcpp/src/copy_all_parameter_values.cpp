// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/copy_all_parameter_values.hpp"

#include "rclcpp/logging.hpp"

namespace rclcpp::detail {

void copy_parameters(const node_interfaces::NodeParametersInterface& from,
                     node_interfaces::NodeParametersInterface& to, bool sets_others,
                     const Logger& logger) {
  for (const auto& name : from.list_parameters({}, 0).names) {
    const Parameter parameter = from.get_parameter(name);
    if (!to.has_parameter(name)) {
      to.declare_parameter(name, parameter.get_parameter_value(),
                           from.describe_parameters({name}).at(0));
    } else if (sets_others) {
      const auto result = to.set_parameters_atomically({parameter});
      if (!result.successful) {
        RCLCPP_WARN(logger, "Unable to set parameter (%s): %s!", name.c_str(),
                    result.reason.c_str());
      }
    }
  }
}

}  // namespace rclcpp::detail
