// The parameters of a node, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_PARAMETERS_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_PARAMETERS_INTERFACE_HPP_

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/list_parameters_result.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_descriptor.hpp"
#include "takt/messages/rcl_interfaces/msg/set_parameters_result.hpp"
#include "takt/ros2/parameter_services.hpp"

#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/parameter.hpp"

namespace rclcpp::node_interfaces {

using rcl_interfaces::msg::SetParametersResult;
using ParameterDescriptor = rcl_interfaces::msg::ParameterDescriptor;

class NodeParametersInterface;

/// A handle keeps its callback registered until it is dropped or removed. Both wait for a call on
/// another thread, unless that call waits for the caller.
#define RCLCPP_PARAMETER_HANDLE_(Name, Handle, ...)  \
  struct Name {                                      \
    RCLCPP_SMART_PTR_ALIASES_ONLY(Name)              \
    using CallbackType = std::function<__VA_ARGS__>; \
    using Name##Type = CallbackType;                 \
    takt::Handle handle;                             \
    const NodeParametersInterface* node = nullptr;   \
  };
RCLCPP_PARAMETER_HANDLE_(PreSetParametersCallbackHandle, PreSetParametersHandle,
                         void(std::vector<Parameter>&))
RCLCPP_PARAMETER_HANDLE_(OnSetParametersCallbackHandle, OnSetParametersHandle,
                         SetParametersResult(const std::vector<Parameter>&))
RCLCPP_PARAMETER_HANDLE_(PostSetParametersCallbackHandle, PostSetParametersHandle,
                         void(const std::vector<Parameter>&))
#undef RCLCPP_PARAMETER_HANDLE_

/// Thread safety: every method from any thread. Real-time: as takt::Node's parameters.
class NodeParametersInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeParametersInterface)
  using OnSetParametersCallbackType = OnSetParametersCallbackHandle::CallbackType;
  using PostSetParametersCallbackType = PostSetParametersCallbackHandle::CallbackType;
  using PreSetParametersCallbackType = PreSetParametersCallbackHandle::CallbackType;

  explicit NodeParametersInterface(NodeBaseInterface::SharedPtr node);

  // Throw exceptions::ParameterAlreadyDeclaredException, InvalidParameterTypeException (the
  // override has another type) or InvalidParameterValueException (the value is out of range, or a
  // callback refuses it).

  ParameterValue declare_parameter(const std::string& name, const ParameterValue& value,
                                   const ParameterDescriptor& descriptor = {},
                                   bool ignore_override = false);
  /// The value is that of the override, or not set.
  ParameterValue declare_parameter(const std::string& name, ParameterType type,
                                   const ParameterDescriptor& descriptor = {},
                                   bool ignore_override = false);
  void undeclare_parameter(const std::string& name);
  bool has_parameter(const std::string& name) const;

  std::vector<SetParametersResult> set_parameters(const std::vector<Parameter>& parameters);
  SetParametersResult set_parameters_atomically(const std::vector<Parameter>& parameters);

  std::vector<Parameter> get_parameters(const std::vector<std::string>& names) const;
  Parameter get_parameter(const std::string& name) const;
  bool get_parameter(const std::string& name, Parameter& parameter) const;
  bool get_parameters_by_prefix(const std::string& prefix,
                                std::map<std::string, Parameter>& parameters) const;
  std::vector<ParameterDescriptor> describe_parameters(const std::vector<std::string>& names) const;
  std::vector<std::uint8_t> get_parameter_types(const std::vector<std::string>& names) const;
  rcl_interfaces::msg::ListParametersResult list_parameters(
      const std::vector<std::string>& prefixes, std::uint64_t depth) const;

  PreSetParametersCallbackHandle::SharedPtr add_pre_set_parameters_callback(
      PreSetParametersCallbackType callback);
  OnSetParametersCallbackHandle::SharedPtr add_on_set_parameters_callback(
      OnSetParametersCallbackType callback);
  PostSetParametersCallbackHandle::SharedPtr add_post_set_parameters_callback(
      PostSetParametersCallbackType callback);
  void remove_pre_set_parameters_callback(const PreSetParametersCallbackHandle* handle);
  void remove_on_set_parameters_callback(const OnSetParametersCallbackHandle* handle);
  void remove_post_set_parameters_callback(const PostSetParametersCallbackHandle* handle);

  const std::map<std::string, ParameterValue>& get_parameter_overrides() const {
    return overrides_;
  }

 private:
  takt::Node& node() const { return *base_->takt_node(); }
  bool may_be_undeclared() const { return base_->options().allow_undeclared_parameters(); }
  void check_declared(const std::string& name) const;
  takt::SetParametersResult check_types(const takt::Parameters& values) const;

  const NodeBaseInterface::SharedPtr base_;
  std::map<std::string, ParameterValue> overrides_;
  mutable std::mutex mutex_;                    // guards what follows
  std::map<std::string, ParameterType> types_;  // of parameters that were declared without a value
  takt::OnSetParametersHandle type_check_;
  std::unique_ptr<takt::ParameterServices> services_;
};

}  // namespace rclcpp::node_interfaces

#endif  // RCLCPP__NODE_INTERFACES__NODE_PARAMETERS_INTERFACE_HPP_
