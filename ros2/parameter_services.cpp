// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/parameter_services.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include <fmt/format.h>

namespace takt {
namespace {

namespace wire = rcl_interfaces;

struct ToMessage {
  using Type = wire::ParameterType;
  void operator()(bool value) { set(Type::boolean, message.bool_value, value); }
  void operator()(std::int64_t value) { set(Type::integer, message.integer_value, value); }
  void operator()(double value) { set(Type::floating_point, message.double_value, value); }
  void operator()(const std::string& value) { set(Type::string, message.string_value, value); }
  void operator()(const std::vector<bool>& value) {
    set(Type::boolean_array, message.bool_array_value, value);
  }
  void operator()(const std::vector<std::int64_t>& value) {
    set(Type::integer_array, message.integer_array_value, value);
  }
  void operator()(const std::vector<double>& value) {
    set(Type::floating_point_array, message.double_array_value, value);
  }
  void operator()(const std::vector<std::string>& value) {
    set(Type::string_array, message.string_array_value, value);
  }

  wire::ParameterValue message;

 private:
  template <class T>
  void set(Type type, T& field, const T& value) {
    message.type = static_cast<std::uint8_t>(type);
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
    message.integer_range.push_back({range->from_value, range->to_value, range->step});
  }
  if (const auto& range = descriptor.floating_point_range) {
    message.floating_point_range.push_back({range->from_value, range->to_value, range->step});
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
      return {false, fmt::format("parameter '{}' of node '{}': {}", parameter.name, node.name(),
                                 error.what())};
    }
  }
  SetParametersResult result = node.set_parameters_atomically(values);
  return {result.successful, std::move(result.reason)};
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
  switch (static_cast<wire::ParameterType>(message.type)) {
    case wire::ParameterType::boolean:
      return message.bool_value;
    case wire::ParameterType::integer:
      return message.integer_value;
    case wire::ParameterType::floating_point:
      return message.double_value;
    case wire::ParameterType::string:
      return message.string_value;
    case wire::ParameterType::boolean_array:
      return message.bool_array_value;
    case wire::ParameterType::integer_array:
      return message.integer_array_value;
    case wire::ParameterType::floating_point_array:
      return message.double_array_value;
    case wire::ParameterType::string_array:
      return message.string_array_value;
    case wire::ParameterType::not_set:
      throw Error("no value is given", "give one; a declared parameter stays declared");
    case wire::ParameterType::byte_array:
      throw Error("a byte array is given, and no parameter is one", "give an integer array");
  }
  throw Error(fmt::format("a value of the unknown type {} is given", message.type));
}

void ParameterServices::publish(const Parameters& values, bool are_new) const {
  wire::ParameterEvent event{.stamp = wire_time(std::chrono::system_clock::now()),
                             .node = node_.fully_qualified_name()};
  auto& list = are_new ? event.new_parameters : event.changed_parameters;
  for (const auto& [name, value] : values) list.push_back({name, to_message(value)});
  events_->publish(event);
}

ParameterServices::ParameterServices(Node& node, Node& host)
    : node_(node),
      events_(host.create_publisher<wire::ParameterEvent>(
          "/parameter_events", qos_profile("parameter_events")->keep_last(10))),
      get_(host.create_service<wire::GetParameters>(
          service_name(node, "get_parameters"),
          [&node](const auto& request, auto& response) {
            response.values =
                for_each<wire::ParameterValue>(node, request.names, [&](const std::string& name) {
                  return to_message(node.get_parameter<ParameterValue>(name));
                });
          },
          nullptr, kRareService)),
      get_types_(host.create_service<wire::GetParameterTypes>(
          service_name(node, "get_parameter_types"),
          [&node](const auto& request, auto& response) {
            response.types =
                for_each<std::uint8_t>(node, request.names, [&](const std::string& name) {
                  return type_of(node.get_parameter<ParameterValue>(name));
                });
          },
          nullptr, kRareService)),
      set_(host.create_service<wire::SetParameters>(
          service_name(node, "set_parameters"),
          [&node](const auto& request, auto& response) {
            for (const wire::Parameter& parameter : request.parameters) {
              response.results.push_back(set(node, {parameter}));
            }
          },
          nullptr, kRareService)),
      set_atomically_(host.create_service<wire::SetParametersAtomically>(
          service_name(node, "set_parameters_atomically"),
          [&node](const auto& request, auto& response) {
            response.result = set(node, request.parameters);
          },
          nullptr, kRareService)),
      list_(host.create_service<wire::ListParameters>(
          service_name(node, "list_parameters"),
          [&node](const auto& request, auto& response) {
            ListParametersResult listed = node.list_parameters(request.prefixes, request.depth);
            response.result = {std::move(listed.names), std::move(listed.prefixes)};
          },
          nullptr, kRareService)),
      describe_(host.create_service<wire::DescribeParameters>(
          service_name(node, "describe_parameters"),
          [&node](const auto& request, auto& response) {
            response.descriptors = for_each<wire::ParameterDescriptor>(
                node, request.names, [&](const std::string& name) {
                  return to_message(name, node.get_parameter<ParameterValue>(name),
                                    node.describe_parameter(name));
                });
          },
          nullptr, kRareService)) {
  Parameters declared;
  for (const std::string& name : node.list_parameters().names) {
    declared.emplace(name, node.get_parameter<ParameterValue>(name));
  }
  if (!declared.empty()) publish(declared, true);
  node.set_parameters_listener(
      [this](const Parameters& values, bool are_new) { publish(values, are_new); });
}

}  // namespace takt
