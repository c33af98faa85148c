// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/parameter_services.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include <fmt/format.h>

#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"
#include "takt/ros2/wire_time.hpp"

namespace takt {
namespace {

namespace wire = rcl_interfaces::msg;
using wire::ParameterType;

struct ToMessage {
  void operator()(bool value) { set(ParameterType::PARAMETER_BOOL, message.bool_value, value); }
  void operator()(std::int64_t value) {
    set(ParameterType::PARAMETER_INTEGER, message.integer_value, value);
  }
  void operator()(double value) {
    set(ParameterType::PARAMETER_DOUBLE, message.double_value, value);
  }
  void operator()(const std::string& value) {
    set(ParameterType::PARAMETER_STRING, message.string_value, value);
  }
  void operator()(const std::vector<bool>& value) {
    set(ParameterType::PARAMETER_BOOL_ARRAY, message.bool_array_value, value);
  }
  void operator()(const std::vector<std::int64_t>& value) {
    set(ParameterType::PARAMETER_INTEGER_ARRAY, message.integer_array_value, value);
  }
  void operator()(const std::vector<double>& value) {
    set(ParameterType::PARAMETER_DOUBLE_ARRAY, message.double_array_value, value);
  }
  void operator()(const std::vector<std::string>& value) {
    set(ParameterType::PARAMETER_STRING_ARRAY, message.string_array_value, value);
  }

  wire::ParameterValue message;

 private:
  template <class T>
  void set(std::uint8_t type, T& field, const T& value) {
    message.type = type;
    field = value;
  }
};

std::uint8_t type_of(const ParameterValue& value) {
  return takt::to_message(value).type;
}

wire::ParameterDescriptor to_message(const std::string& name, const ParameterValue& value,
                                     const ParameterDescriptor& descriptor) {
  wire::ParameterDescriptor message;
  message.name = name;
  message.type = type_of(value);
  message.description = descriptor.description;
  message.read_only = descriptor.read_only;
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

// All of them, or none when one is not declared. Nothing is ever undeclared, so they stay.
template <class Item, class Make>
std::vector<Item> for_each(const Node& node, const std::vector<std::string>& names, Make make) {
  const auto is_declared = [&](const std::string& name) { return node.has_parameter(name); };
  std::vector<Item> items;
  if (std::all_of(names.begin(), names.end(), is_declared)) {
    std::transform(names.begin(), names.end(), std::back_inserter(items), make);
  }
  return items;
}

wire::SetParametersResult set(Node& node, const std::vector<wire::Parameter>& parameters) {
  Parameters values;
  for (const wire::Parameter& parameter : parameters) {
    try {
      values.insert_or_assign(parameter.name, from_message(parameter.value));
    } catch (const Error& error) {
      return wire::SetParametersResult().set__reason(fmt::format(
          "parameter '{}' of node '{}': {}", parameter.name, node.name(), error.what()));
    }
  }
  SetParametersResult result = node.set_parameters_atomically(values);
  return wire::SetParametersResult()
      .set__successful(result.successful)
      .set__reason(std::move(result.reason));
}

wire::ListParametersResult to_message(ListParametersResult listed) {
  return wire::ListParametersResult()
      .set__names(std::move(listed.names))
      .set__prefixes(std::move(listed.prefixes));
}

// The name of a service of this node, by whichever node it is served.
std::string service_name(const Node& node, std::string_view service) {
  return fmt::format("{}/{}", node.fully_qualified_name(), service);
}

}  // namespace

wire::ParameterValue to_message(const ParameterValue& value) {
  ToMessage visitor;
  std::visit(visitor, value);
  return std::move(visitor.message);
}

ParameterValue from_message(const wire::ParameterValue& message) {
  switch (message.type) {
    case ParameterType::PARAMETER_BOOL:
      return message.bool_value;
    case ParameterType::PARAMETER_INTEGER:
      return message.integer_value;
    case ParameterType::PARAMETER_DOUBLE:
      return message.double_value;
    case ParameterType::PARAMETER_STRING:
      return message.string_value;
    case ParameterType::PARAMETER_BOOL_ARRAY:
      return message.bool_array_value;
    case ParameterType::PARAMETER_INTEGER_ARRAY:
      return message.integer_array_value;
    case ParameterType::PARAMETER_DOUBLE_ARRAY:
      return message.double_array_value;
    case ParameterType::PARAMETER_STRING_ARRAY:
      return message.string_array_value;
    case ParameterType::PARAMETER_NOT_SET:
      throw Error("no value is given", "give one; a declared parameter stays declared");
    case ParameterType::PARAMETER_BYTE_ARRAY:
      throw Error("a byte array is given, and no parameter is one", "give an integer array");
    default:
      throw Error(fmt::format("a value of the unknown type {} is given", message.type));
  }
}

void ParameterServices::publish(const Parameters& values, bool are_new) const {
  wire::ParameterEvent event;
  event.stamp = wire_time(std::chrono::system_clock::now());
  event.node = node_.fully_qualified_name();
  auto& list = are_new ? event.new_parameters : event.changed_parameters;
  for (const auto& [name, value] : values) {
    list.push_back(wire::Parameter().set__name(name).set__value(to_message(value)));
  }
  events_->publish(event);
}

ParameterServices::ParameterServices(Node& node, Node& host)
    : node_(node),
      events_(host.create_publisher<wire::ParameterEvent>(
          "/parameter_events", qos_profile("parameter_events")->keep_last(10),
          {.graph_node = node.fully_qualified_name()})),
      get_(host.create_service<rcl_interfaces::srv::GetParameters>(
          service_name(node, "get_parameters"),
          [&node](const auto& request, auto& response) {
            response.values =
                for_each<wire::ParameterValue>(node, request.names, [&](const std::string& name) {
                  return to_message(node.get_parameter<ParameterValue>(name));
                });
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      get_types_(host.create_service<rcl_interfaces::srv::GetParameterTypes>(
          service_name(node, "get_parameter_types"),
          [&node](const auto& request, auto& response) {
            response.types =
                for_each<std::uint8_t>(node, request.names, [&](const std::string& name) {
                  return type_of(node.get_parameter<ParameterValue>(name));
                });
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      set_(host.create_service<rcl_interfaces::srv::SetParameters>(
          service_name(node, "set_parameters"),
          [&node](const auto& request, auto& response) {
            for (const wire::Parameter& parameter : request.parameters) {
              response.results.push_back(set(node, {parameter}));
            }
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      set_atomically_(host.create_service<rcl_interfaces::srv::SetParametersAtomically>(
          service_name(node, "set_parameters_atomically"),
          [&node](const auto& request, auto& response) {
            response.result = set(node, request.parameters);
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      list_(host.create_service<rcl_interfaces::srv::ListParameters>(
          service_name(node, "list_parameters"),
          [&node](const auto& request, auto& response) {
            response.result = to_message(node.list_parameters(request.prefixes, request.depth));
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      describe_(host.create_service<rcl_interfaces::srv::DescribeParameters>(
          service_name(node, "describe_parameters"),
          [&node](const auto& request, auto& response) {
            response.descriptors = for_each<wire::ParameterDescriptor>(
                node, request.names, [&](const std::string& name) {
                  return to_message(name, node.get_parameter<ParameterValue>(name),
                                    node.describe_parameter(name));
                });
          },
          nullptr, rare_service(node.fully_qualified_name()))) {
  publish_events();
}

void ParameterServices::publish_events() {
  Parameters declared;
  for (const std::string& name : node_.list_parameters().names) {
    declared.emplace(name, node_.get_parameter<ParameterValue>(name));
  }
  if (!declared.empty()) publish(declared, true);
  node_.set_parameters_listener(
      [this](const Parameters& values, bool are_new) { publish(values, are_new); });
}

}  // namespace takt
