// Options of nodes, as programs for rclcpp write them.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_OPTIONS_HPP_
#define RCLCPP__NODE_OPTIONS_HPP_

#include <optional>
#include <string>
#include <vector>

#include "takt/nodes/node_options.hpp"

#include "rclcpp/context.hpp"
#include "rclcpp/parameter.hpp"
#include "rclcpp/qos.hpp"

namespace rclcpp {

/// Thread safety: a value. Real-time: set-up only.
class NodeOptions {
 public:
  NodeOptions() = default;
  /// For components of a Takt container, which decides names, parameters and more.
  explicit NodeOptions(takt::NodeOptions options) : takt_(std::move(options)) {}

#define RCLCPP_OPTION_(Type, name, initial) \
 public:                                    \
  const Type& name() const {                \
    return name##_;                         \
  }                                         \
  NodeOptions& name(const Type& value) {    \
    return name##_ = value, *this;          \
  }                                         \
                                            \
 private:                                   \
  Type name##_ = initial;

  RCLCPP_OPTION_(Context::SharedPtr, context, contexts::get_global_default_context())
  RCLCPP_OPTION_(std::vector<std::string>, arguments, {})
  RCLCPP_OPTION_(std::vector<Parameter>, parameter_overrides, {})
  RCLCPP_OPTION_(bool, use_global_arguments, true)
  RCLCPP_OPTION_(bool, enable_rosout, true)
  RCLCPP_OPTION_(bool, use_intra_process_comms, false)
  RCLCPP_OPTION_(bool, enable_topic_statistics, false)
  RCLCPP_OPTION_(bool, start_parameter_services, true)
  RCLCPP_OPTION_(bool, start_parameter_event_publisher, true)
  RCLCPP_OPTION_(bool, enable_logger_service, false)
  RCLCPP_OPTION_(rcl_clock_type_t, clock_type, RCL_ROS_TIME)
  RCLCPP_OPTION_(bool, use_clock_thread, true)
  RCLCPP_OPTION_(bool, allow_undeclared_parameters, false)
  RCLCPP_OPTION_(bool, automatically_declare_parameters_from_overrides, false)
  RCLCPP_OPTION_(QoS, clock_qos, ClockQoS())
  RCLCPP_OPTION_(QoS, parameter_event_qos, ParameterEventsQoS())
  RCLCPP_OPTION_(QoS, rosout_qos, RosoutQoS())
#undef RCLCPP_OPTION_

 public:
  std::vector<Parameter>& parameter_overrides() {
    return parameter_overrides_;
  }
  template <class T>
  NodeOptions& append_parameter_override(const std::string& name, const T& value) {
    parameter_overrides_.emplace_back(name, ParameterValue(value));
    return *this;
  }

  // For this library. nullopt: the node is not in a Takt container.
  const std::optional<takt::NodeOptions>& takt() const {
    return takt_;
  }

 private:
  std::optional<takt::NodeOptions> takt_;
};

}  // namespace rclcpp

#endif  // RCLCPP__NODE_OPTIONS_HPP_
