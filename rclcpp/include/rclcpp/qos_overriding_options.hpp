// Parameters that override the QoS of a topic.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__QOS_OVERRIDING_OPTIONS_HPP_
#define RCLCPP__QOS_OVERRIDING_OPTIONS_HPP_

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/set_parameters_result.hpp"

#include "rclcpp/qos.hpp"

namespace rclcpp {

enum class QosPolicyKind {
  AvoidRosNamespaceConventions = RMW_QOS_POLICY_AVOID_ROS_NAMESPACE_CONVENTIONS,
  Deadline = RMW_QOS_POLICY_DEADLINE,
  Depth = RMW_QOS_POLICY_DEPTH,
  Durability = RMW_QOS_POLICY_DURABILITY,
  History = RMW_QOS_POLICY_HISTORY,
  Lifespan = RMW_QOS_POLICY_LIFESPAN,
  Liveliness = RMW_QOS_POLICY_LIVELINESS,
  LivelinessLeaseDuration = RMW_QOS_POLICY_LIVELINESS_LEASE_DURATION,
  Reliability = RMW_QOS_POLICY_RELIABILITY,
  Invalid = RMW_QOS_POLICY_INVALID,
};
using QosCallbackResult = rcl_interfaces::msg::SetParametersResult;
using QosCallback = std::function<QosCallbackResult(const QoS&)>;

/// Thread safety: a value. Real-time: set-up only.
class QosOverridingOptions {
 public:
  QosOverridingOptions() = default;
  QosOverridingOptions(std::initializer_list<QosPolicyKind> policies,
                       QosCallback validation = nullptr, std::string id = {})
      : policies_(policies), validation_(std::move(validation)), id_(std::move(id)) {}
  static QosOverridingOptions with_default_policies(QosCallback validation = nullptr,
                                                    std::string id = {}) {
    return {{QosPolicyKind::History, QosPolicyKind::Depth, QosPolicyKind::Reliability},
            std::move(validation),
            std::move(id)};
  }
  const std::string& get_id() const { return id_; }
  const std::vector<QosPolicyKind>& get_policy_kinds() const { return policies_; }
  const QosCallback& get_validation_callback() const { return validation_; }

 private:
  std::vector<QosPolicyKind> policies_;
  QosCallback validation_;
  std::string id_;
};

}  // namespace rclcpp

#endif  // RCLCPP__QOS_OVERRIDING_OPTIONS_HPP_
