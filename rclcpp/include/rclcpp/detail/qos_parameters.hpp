// The QoS of a topic, overridden by parameters of its node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__QOS_PARAMETERS_HPP_
#define RCLCPP__DETAIL__QOS_PARAMETERS_HPP_

#include <string>

#include "rclcpp/qos_overriding_options.hpp"

namespace rclcpp {
namespace node_interfaces {
class NodeParametersInterface;
}

namespace detail {

/// Declares the read-only parameters `qos_overrides.TOPIC.publisher.depth` and so on.
/// Thread safety: as the node. Real-time: set-up only.
class QosParameters {
 public:
  explicit QosParameters(node_interfaces::NodeParametersInterface& parameters)
      : parameters_(&parameters) {}
  /// For an interface of a node that gives no access to its parameters.
  QosParameters() = default;
  /// Throws exceptions::InvalidParameterValueException for a value that the policy does not have,
  /// and std::runtime_error for options that override QoS without access to parameters.
  QoS apply(const QoS& qos, const std::string& topic, const QosOverridingOptions& options,
            bool is_subscription) const;

 private:
  node_interfaces::NodeParametersInterface* parameters_ = nullptr;
};

}  // namespace detail
}  // namespace rclcpp

#endif  // RCLCPP__DETAIL__QOS_PARAMETERS_HPP_
