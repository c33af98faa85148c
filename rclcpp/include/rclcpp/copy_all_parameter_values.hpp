// Parameters of one node for another.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__COPY_ALL_PARAMETER_VALUES_HPP_
#define RCLCPP__COPY_ALL_PARAMETER_VALUES_HPP_

#include "rclcpp/logger.hpp"
#include "rclcpp/node_interfaces/node_parameters_interface.hpp"

namespace rclcpp {
namespace detail {
void copy_parameters(const node_interfaces::NodeParametersInterface& from,
                     node_interfaces::NodeParametersInterface& to, bool sets_others,
                     const Logger& logger);
}

/// Declares what `destination` lacks of the parameters of `source`. With `override_existing_params`
/// it sets the others, too; a warning names those that cannot be set. Thread safety: as the
/// parameters of both nodes. Real-time: set-up only.
template <class Source, class Destination>
void copy_all_parameter_values(const Source& source, const Destination& destination,
                               const bool override_existing_params = false) {
  detail::copy_parameters(*source->get_node_parameters_interface(),
                          *destination->get_node_parameters_interface(), override_existing_params,
                          destination->get_node_logging_interface()->get_logger());
}

}  // namespace rclcpp

#endif  // RCLCPP__COPY_ALL_PARAMETER_VALUES_HPP_
