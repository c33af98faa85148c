// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/node_interfaces/node_parameters_interface.hpp"

namespace rclcpp::node_interfaces {
namespace {

takt::ParameterDescriptor to_takt(const ParameterDescriptor& message) {
  takt::ParameterDescriptor descriptor{.description = message.description,
                                       .additional_constraints = message.additional_constraints,
                                       .read_only = message.read_only,
                                       .dynamic_typing = message.dynamic_typing};
  for (const auto& range : message.integer_range) {
    descriptor.integer_range = {range.from_value, range.to_value, range.step};
  }
  for (const auto& range : message.floating_point_range) {
    descriptor.floating_point_range = {range.from_value, range.to_value, range.step};
  }
  return descriptor;
}
ParameterDescriptor to_message(const std::string& name, ParameterType type,
                               const takt::ParameterDescriptor& descriptor) {
  ParameterDescriptor message;
  message.name = name;
  message.type = type;
  message.description = descriptor.description;
  message.additional_constraints = descriptor.additional_constraints;
  message.read_only = descriptor.read_only;
  message.dynamic_typing = descriptor.dynamic_typing;
  if (const auto& range = descriptor.integer_range) {
    message.integer_range.push_back(rcl_interfaces::msg::IntegerRange()
                                        .set__from_value(range->from_value)
                                        .set__to_value(range->to_value)
                                        .set__step(range->step));
  }
  if (const auto& range = descriptor.floating_point_range) {
    message.floating_point_range.push_back(rcl_interfaces::msg::FloatingPointRange()
                                               .set__from_value(range->from_value)
                                               .set__to_value(range->to_value)
                                               .set__step(range->step));
  }
  return message;
}
SetParametersResult to_message(const takt::SetParametersResult& result) {
  return SetParametersResult().set__successful(result.successful).set__reason(result.reason);
}
takt::SetParametersResult to_takt(const SetParametersResult& result) {
  return {result.successful, result.reason};
}
std::vector<Parameter> to_list(const takt::Parameters& values) {
  std::vector<Parameter> list;
  for (const auto& [name, value] : values) list.emplace_back(name, ParameterValue(value));
  return list;
}

[[noreturn]] void refuse_value(const std::string& name, const std::string& reason) {
  throw exceptions::InvalidParameterValueException("parameter '" + name +
                                                   "' could not be set: " + reason);
}

/// `[]` in a file or an argument is an empty list of the type that the program declares.
ParameterValue of_type(const ParameterValue& given, ParameterType type) {
  const bool is_empty =
      given.get_type() == PARAMETER_STRING_ARRAY && given.get<std::vector<std::string>>().empty();
  if (!is_empty) return given;
  switch (type) {
    case PARAMETER_BYTE_ARRAY:
      return ParameterValue(std::vector<std::uint8_t>());
    case PARAMETER_BOOL_ARRAY:
      return ParameterValue(std::vector<bool>());
    case PARAMETER_INTEGER_ARRAY:
      return ParameterValue(std::vector<std::int64_t>());
    case PARAMETER_DOUBLE_ARRAY:
      return ParameterValue(std::vector<double>());
    default:
      return given;
  }
}

}  // namespace

NodeParametersInterface::NodeParametersInterface(NodeBaseInterface::SharedPtr node_base)
    : base_(std::move(node_base)) {
  for (auto& [name, value] : base_->parameter_overrides(base_->get_fully_qualified_name())) {
    overrides_.emplace(name, ParameterValue(value));
  }
  const NodeOptions& options = base_->options();
  const bool is_served = options.takt().has_value();  // by the container
  if (options.start_parameter_services() && !is_served) {
    services_ = std::make_unique<takt::ParameterServices>(node(), node());
  }
  if (!options.automatically_declare_parameters_from_overrides()) return;
  for (const auto& [name, value] : overrides_) {
    if (!has_parameter(name)) {
      declare_parameter(name, value, ParameterDescriptor().set__dynamic_typing(true));
    }
  }
}

ParameterValue NodeParametersInterface::declare_parameter(const std::string& name,
                                                          const ParameterValue& value,
                                                          const ParameterDescriptor& descriptor,
                                                          bool ignore_override) {
  if (name.empty())
    throw exceptions::InvalidParametersException("parameter name must not be empty");
  if (has_parameter(name)) {
    throw exceptions::ParameterAlreadyDeclaredException("parameter '" + name +
                                                        "' has already been declared");
  }
  const auto given = overrides_.find(name);
  const bool is_given = given != overrides_.end() && !ignore_override;
  const ParameterValue initial = is_given ? of_type(given->second, value.get_type()) : value;
  if (!descriptor.dynamic_typing && initial.get_type() != value.get_type()) {
    throw exceptions::InvalidParameterTypeException(
        name, "overridden by a value of type {" + to_string(initial.get_type()) +
                  "}, declared with type {" + to_string(value.get_type()) + "}");
  }
  try {
    return ParameterValue(node().declare_parameter<takt::ParameterValue>(name, initial.to_takt(),
                                                                         to_takt(descriptor)));
  } catch (const takt::Error& error) {
    refuse_value(name, error.what());
  }
}

ParameterValue NodeParametersInterface::declare_parameter(const std::string& name,
                                                          ParameterType type,
                                                          const ParameterDescriptor& descriptor,
                                                          bool ignore_override) {
  if (type == PARAMETER_NOT_SET) {
    throw std::invalid_argument("declare_parameter: the provided parameter type is invalid");
  }
  if (descriptor.dynamic_typing) {
    throw std::invalid_argument(
        "declare_parameter: cannot declare parameter of specific type and "
        "pass descriptor with dynamic_typing");
  }
  const auto given = overrides_.find(name);
  if (given != overrides_.end() && !ignore_override) {
    const ParameterValue initial = of_type(given->second, type);
    if (initial.get_type() != type) {
      throw exceptions::InvalidParameterTypeException(
          name, "overridden by a value of type {" + to_string(initial.get_type()) +
                    "}, declared with type {" + to_string(type) + "}");
    }
    return declare_parameter(name, initial, descriptor);
  }
  // In Takt, a parameter without a value accepts any type: check_types() checks this one when it is
  // set.
  auto unset = descriptor;
  const auto value = declare_parameter(name, ParameterValue(), unset.set__dynamic_typing(true));
  const std::lock_guard lock(mutex_);
  types_[name] = type;
  if (type_check_ == nullptr) {
    type_check_ = node().add_on_set_parameters_callback(
        [this](const takt::Parameters& values) { return check_types(values); });
  }
  return value;
}

takt::SetParametersResult NodeParametersInterface::check_types(
    const takt::Parameters& values) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [name, value] : values) {
    const auto type = types_.find(name);
    if (type != types_.end() && value.index() != 0 && value.index() != type->second) {
      return {false, "Wrong parameter type, parameter {" + name + "} is of type {" +
                         to_string(type->second) + "}, setting it to {" +
                         to_string(static_cast<ParameterType>(value.index())) +
                         "} is not allowed."};
    }
  }
  return {};
}

void NodeParametersInterface::check_declared(const std::string& name) const {
  if (!has_parameter(name)) {
    throw exceptions::ParameterNotDeclaredException("parameter '" + name + "' is not declared");
  }
}

void NodeParametersInterface::undeclare_parameter(const std::string& name) {
  check_declared(name);
  const auto described = node().describe_parameter(name);
  if (described.read_only) {
    throw exceptions::ParameterImmutableException("cannot undeclare parameter '" + name +
                                                  "' because it is read-only");
  }
  if (!described.dynamic_typing) {
    throw exceptions::InvalidParameterTypeException(
        name, "cannot undeclare a statically typed parameter");
  }
  node().undeclare_parameter(name);
}
bool NodeParametersInterface::has_parameter(const std::string& name) const {
  return node().has_parameter(name);
}

std::vector<SetParametersResult> NodeParametersInterface::set_parameters(
    const std::vector<Parameter>& parameters) {
  std::vector<SetParametersResult> results;
  for (const Parameter& parameter : parameters) {
    results.push_back(set_parameters_atomically({parameter}));
  }
  return results;
}
SetParametersResult NodeParametersInterface::set_parameters_atomically(
    const std::vector<Parameter>& parameters) {
  takt::Parameters values;
  for (const Parameter& parameter : parameters) {
    if (!may_be_undeclared() && !has_parameter(parameter.get_name())) {
      throw exceptions::ParameterNotDeclaredException(
          "parameter '" + parameter.get_name() + "' cannot be set because it was not declared");
    }
    values.insert_or_assign(parameter.get_name(), parameter.get_parameter_value().to_takt());
  }
  try {
    return to_message(node().set_parameters_atomically(values));
  } catch (const takt::Error& error) {
    throw exceptions::ParameterModifiedInCallbackException(error.what());
  }
}

Parameter NodeParametersInterface::get_parameter(const std::string& name) const {
  Parameter parameter(name);
  if (get_parameter(name, parameter)) return parameter;
  if (has_parameter(name)) {
    if (node().describe_parameter(name).dynamic_typing && !types_.contains(name)) return parameter;
    throw exceptions::ParameterUninitializedException(name);
  }
  if (may_be_undeclared()) return parameter;
  throw exceptions::ParameterNotDeclaredException("parameter '" + name + "' is not declared");
}
bool NodeParametersInterface::get_parameter(const std::string& name, Parameter& parameter) const {
  auto value = node().get_parameter_or<takt::ParameterValue>(name, {});
  if (value.index() == 0) return false;
  parameter = Parameter(name, ParameterValue(std::move(value)));
  return true;
}
std::vector<Parameter> NodeParametersInterface::get_parameters(
    const std::vector<std::string>& names) const {
  std::vector<Parameter> result;
  for (const auto& name : names) result.push_back(get_parameter(name));
  return result;
}
bool NodeParametersInterface::get_parameters_by_prefix(
    const std::string& prefix, std::map<std::string, Parameter>& parameters) const {
  for (auto& [name, value] : node().get_parameters_by_prefix(prefix)) {
    const std::string full = prefix.empty() ? name : prefix + "." + name;
    parameters[name] = Parameter(full, ParameterValue(value));
  }
  return !parameters.empty();
}
std::vector<ParameterDescriptor> NodeParametersInterface::describe_parameters(
    const std::vector<std::string>& names) const {
  std::vector<ParameterDescriptor> result;
  const auto types = get_parameter_types(names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    result.push_back(to_message(names[i], static_cast<ParameterType>(types[i]),
                                node().describe_parameter(names[i])));
  }
  return result;
}
std::vector<std::uint8_t> NodeParametersInterface::get_parameter_types(
    const std::vector<std::string>& names) const {
  std::vector<std::uint8_t> types;
  for (const auto& name : names) {
    if (!may_be_undeclared()) check_declared(name);
    types.push_back(
        static_cast<std::uint8_t>(node().get_parameter_or<takt::ParameterValue>(name, {}).index()));
  }
  return types;
}
rcl_interfaces::msg::ListParametersResult NodeParametersInterface::list_parameters(
    const std::vector<std::string>& prefixes, std::uint64_t depth) const {
  const auto found = node().list_parameters(prefixes, depth);
  rcl_interfaces::msg::ListParametersResult result;
  result.names = found.names;
  result.prefixes = found.prefixes;
  return result;
}

PreSetParametersCallbackHandle::SharedPtr NodeParametersInterface::add_pre_set_parameters_callback(
    PreSetParametersCallbackType callback) {
  auto handle = std::make_shared<PreSetParametersCallbackHandle>();
  handle->node = this;
  handle->handle = node().add_pre_set_parameters_callback(
      [callback = std::move(callback)](takt::Parameters& values) {
        auto list = to_list(values);
        callback(list);
        values.clear();
        for (const Parameter& parameter : list) {
          values.insert_or_assign(parameter.get_name(), parameter.get_parameter_value().to_takt());
        }
      });
  return handle;
}
OnSetParametersCallbackHandle::SharedPtr NodeParametersInterface::add_on_set_parameters_callback(
    OnSetParametersCallbackType callback) {
  auto handle = std::make_shared<OnSetParametersCallbackHandle>();
  handle->node = this;
  handle->handle = node().add_on_set_parameters_callback(
      [callback = std::move(callback)](const takt::Parameters& values) {
        return to_takt(callback(to_list(values)));
      });
  return handle;
}
PostSetParametersCallbackHandle::SharedPtr
NodeParametersInterface::add_post_set_parameters_callback(PostSetParametersCallbackType callback) {
  auto handle = std::make_shared<PostSetParametersCallbackHandle>();
  handle->node = this;
  handle->handle = node().add_post_set_parameters_callback(
      [callback = std::move(callback)](const takt::Parameters& values) {
        callback(to_list(values));
      });
  return handle;
}
// The user's handle stays, without its callback.
namespace {
template <class Handle>
void remove(const Handle* handle, const NodeParametersInterface* node, const char* kind) {
  if (handle == nullptr || handle->node != node || handle->handle == nullptr) {
    throw std::runtime_error(std::string(kind) + " parameter callback doesn't exist");
  }
  std::exchange(const_cast<Handle*>(handle)->handle, nullptr).reset();
}
}  // namespace
void NodeParametersInterface::remove_pre_set_parameters_callback(
    const PreSetParametersCallbackHandle* handle) {
  remove(handle, this, "Pre set");
}
void NodeParametersInterface::remove_on_set_parameters_callback(
    const OnSetParametersCallbackHandle* handle) {
  remove(handle, this, "On set");
}
void NodeParametersInterface::remove_post_set_parameters_callback(
    const PostSetParametersCallbackHandle* handle) {
  remove(handle, this, "Post set");
}

}  // namespace rclcpp::node_interfaces
