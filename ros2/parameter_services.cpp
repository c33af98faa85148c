// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/parameter_services.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"

namespace takt {
namespace {

namespace wire = rcl_interfaces::msg;
namespace srv = rcl_interfaces::srv;
using wire::ParameterType;

// The alternatives of ParameterValue are in the order of ROS 2's ParameterType.
std::uint8_t type_of(const ParameterValue& value) {
  return static_cast<std::uint8_t>(value.index());
}

struct ToMessage {
  void operator()(std::monostate) {}
  void operator()(bool value) { message.bool_value = value; }
  void operator()(std::int64_t value) { message.integer_value = value; }
  void operator()(double value) { message.double_value = value; }
  void operator()(const std::string& value) { message.string_value = value; }
  void operator()(const std::vector<std::uint8_t>& value) { message.byte_array_value = value; }
  void operator()(const std::vector<bool>& value) { message.bool_array_value = value; }
  void operator()(const std::vector<std::int64_t>& value) { message.integer_array_value = value; }
  void operator()(const std::vector<double>& value) { message.double_array_value = value; }
  void operator()(const std::vector<std::string>& value) { message.string_array_value = value; }

  wire::ParameterValue message;
};

wire::ParameterDescriptor to_message(const std::string& name, const ParameterValue& value,
                                     const ParameterDescriptor& descriptor) {
  wire::ParameterDescriptor message;
  message.name = name;
  message.type = type_of(value);
  message.description = descriptor.description;
  message.additional_constraints = descriptor.additional_constraints;
  message.read_only = descriptor.read_only;
  message.dynamic_typing = descriptor.dynamic_typing;
  if (const auto& range = descriptor.integer_range) {
    message.integer_range.push_back(wire::IntegerRange()
                                        .set__from_value(range->from_value)
                                        .set__to_value(range->to_value)
                                        .set__step(range->step));
  }
  if (const auto& range = descriptor.floating_point_range) {
    message.floating_point_range.push_back(wire::FloatingPointRange()
                                               .set__from_value(range->from_value)
                                               .set__to_value(range->to_value)
                                               .set__step(range->step));
  }
  return message;
}

// All these parameters, or none when one is not declared.
std::vector<Parameter> parameters_of(const Node& node, const std::vector<std::string>& names) {
  try {
    return node.get_parameters(names);
  } catch (const Error&) {
    return {};
  }
}

std::vector<wire::ParameterDescriptor> descriptors_of(const Node& node,
                                                      const std::vector<std::string>& names) {
  const std::vector<Parameter> parameters = parameters_of(node, names);
  std::vector<wire::ParameterDescriptor> messages;
  try {
    for (const auto& [name, value] : parameters) {
      messages.push_back(to_message(name, value, node.describe_parameter(name)));
    }
  } catch (const Error&) {  // undeclared meanwhile
    return {};
  }
  return messages;
}

// An exception of a parameter callback gives a negative result, and becomes the failure of the
// service.
wire::SetParametersResult set(Node& node, const std::vector<wire::Parameter>& parameters,
                              std::exception_ptr& failure) {
  Parameters values;
  for (const wire::Parameter& parameter : parameters) {
    try {
      values.insert_or_assign(parameter.name, from_message(parameter.value));
    } catch (const Error& error) {
      return wire::SetParametersResult().set__reason(fmt::format(
          "parameter '{}' of node '{}': {}", parameter.name, node.name(), error.what()));
    }
  }
  SetParametersResult result;
  try {
    result = node.set_parameters_atomically(values);
  } catch (...) {
    const std::exception_ptr thrown = std::current_exception();
    result = {false, fmt::format("a parameter callback of node '{}' threw: {}", node.name(),
                                 text_of(thrown))};
    if (failure == nullptr) failure = thrown;
  }
  return wire::SetParametersResult()
      .set__successful(result.successful)
      .set__reason(std::move(result.reason));
}

wire::ListParametersResult to_message(ListParametersResult listed) {
  return wire::ListParametersResult()
      .set__names(std::move(listed.names))
      .set__prefixes(std::move(listed.prefixes));
}

// Writes the reason of a refusal into the response. Responses of services that only read have no
// field for it.
void refuse(srv::SetParameters::Response& response, std::string why) {
  response.results.push_back(wire::SetParametersResult().set__reason(std::move(why)));
}
void refuse(srv::SetParametersAtomically::Response& response, std::string why) {
  response.result.reason = std::move(why);
}
void refuse(auto&, const std::string&) {
}

// Makes a service of the node, as an entity of the host. The service keeps the node while it runs:
// a parameter callback of the user may drop the node.
template <class S, class F>
std::shared_ptr<Service<S>> serve(const Node& node, Node& host, std::string_view name, F callback,
                                  const std::shared_ptr<CallbackGroup>& group = nullptr) {
  const std::string& owner = node.fully_qualified_name();
  const std::string service = fmt::format("{}/{}", owner, name);
  using Request = typename S::Request;
  using Response = typename S::Response;
  using Result = std::invoke_result_t<F&, const Request&, Response&>;
  const auto limited = [weak = node.weak_from_this(), callback = std::move(callback), service](
                           const Request& request, Response& response) -> Result {
    const auto kept = weak.lock();
    std::string why = why_too_long(request);
    if (why.empty()) return callback(request, response);
    static constinit LogThrottle throttle(1);
    if (throttle.may_log()) log(LogLevel::warn, "{}: {}", service, why);
    refuse(response, std::move(why));
    return Result();
  };
  return host.create_service<S>(service, limited, group, rare_service(owner));
}

}  // namespace

wire::ParameterValue to_message(const ParameterValue& value) {
  ToMessage visitor;
  std::visit(visitor, value);
  visitor.message.type = type_of(value);
  return std::move(visitor.message);
}

ParameterValue from_message(const wire::ParameterValue& message) {
  switch (message.type) {
    case ParameterType::PARAMETER_NOT_SET:
      return {};
    case ParameterType::PARAMETER_BOOL:
      return message.bool_value;
    case ParameterType::PARAMETER_INTEGER:
      return message.integer_value;
    case ParameterType::PARAMETER_DOUBLE:
      return message.double_value;
    case ParameterType::PARAMETER_STRING:
      return message.string_value;
    case ParameterType::PARAMETER_BYTE_ARRAY:
      return message.byte_array_value;
    case ParameterType::PARAMETER_BOOL_ARRAY:
      return message.bool_array_value;
    case ParameterType::PARAMETER_INTEGER_ARRAY:
      return message.integer_array_value;
    case ParameterType::PARAMETER_DOUBLE_ARRAY:
      return message.double_array_value;
    case ParameterType::PARAMETER_STRING_ARRAY:
      return message.string_array_value;
    default:
      throw Error(fmt::format("a value of the unknown type {} is given", message.type));
  }
}

void ParameterServices::publish(const ParameterChanges& changes) const {
  const auto messages = [](const Parameters& values) {
    std::vector<wire::Parameter> list;
    for (const auto& [name, value] : values) {
      list.push_back(wire::Parameter().set__name(name).set__value(to_message(value)));
    }
    return list;
  };
  wire::ParameterEvent event;
  event.stamp = node_.now();
  event.node = node_.fully_qualified_name();
  event.new_parameters = messages(changes.added);
  event.changed_parameters = messages(changes.changed);
  for (const std::string& name : changes.deleted) {
    event.deleted_parameters.push_back(wire::Parameter().set__name(name));
  }
  events_->publish(event);
}

ParameterServices::ParameterServices(Node& node, Node& host,
                                     const std::shared_ptr<CallbackGroup>& group)
    : node_(node),
      events_(host.create_publisher<wire::ParameterEvent>(
          "/parameter_events", qos_profile("parameter_events")->keep_last(100),
          {.graph_node = node.fully_qualified_name()})),
      get_(serve<srv::GetParameters>(node, host, "get_parameters",
                                     [&node](const auto& request, auto& response) {
                                       for (const auto& [name, value] :
                                            parameters_of(node, request.names)) {
                                         response.values.push_back(to_message(value));
                                       }
                                     })),
      get_types_(serve<srv::GetParameterTypes>(node, host, "get_parameter_types",
                                               [&node](const auto& request, auto& response) {
                                                 for (const auto& [name, value] :
                                                      parameters_of(node, request.names)) {
                                                   response.types.push_back(type_of(value));
                                                 }
                                               })),
      set_(serve<srv::SetParameters>(
          node, host, "set_parameters",
          [&node](const auto& request, auto& response) {
            std::exception_ptr failure;
            for (const wire::Parameter& parameter : request.parameters) {
              response.results.push_back(set(node, {parameter}, failure));
            }
            return failure;
          },
          group)),
      set_atomically_(serve<srv::SetParametersAtomically>(
          node, host, "set_parameters_atomically",
          [&node](const auto& request, auto& response) {
            std::exception_ptr failure;
            response.result = set(node, request.parameters, failure);
            return failure;
          },
          group)),
      list_(serve<srv::ListParameters>(node, host, "list_parameters",
                                       [&node](const auto& request, auto& response) {
                                         response.result = to_message(
                                             node.list_parameters(request.prefixes, request.depth));
                                       })),
      describe_(serve<srv::DescribeParameters>(
          node, host, "describe_parameters", [&node](const auto& request, auto& response) {
            response.descriptors = descriptors_of(node, request.names);
          })) {
  publish({.added = node.get_parameters_by_prefix("")});
  node.set_parameters_listener([this](const ParameterChanges& changes) { publish(changes); });
}

}  // namespace takt
