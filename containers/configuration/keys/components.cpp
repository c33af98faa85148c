// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/keys/readers.hpp"
#include "takt/containers/configuration/parameter_file.hpp"

namespace takt {
namespace {

// Adds the parameters of a file, except those that the component's `parameters` give.
void add_parameters_of(const std::string& path, ComponentDescription& component) {
  if (component.name.empty()) {
    throw Error("a parameter file is for nodes by their names, and this component has none here",
                "add 'name'");
  }
  document::Errors errors(path);
  const document::Value file = document::read(path, errors, document::Rules::parameters);
  for (const auto& value : document::parameters_of(file, full_name(component), errors)) {
    const std::optional<ParameterValue> parameter = read_parameter(value, errors);
    if (parameter && component.parameters.try_emplace(value.name, *parameter).second)
      component.parameter_lines.try_emplace(value.name, errors.where(value.line));
  }
  errors.throw_if_any();
}

template <class T>
std::optional<T> item_of(const document::Value& value) {
  if (const T* content = std::get_if<T>(&value.content)) return *content;
  if constexpr (std::is_same_v<T, double>) {  // in a list of numbers, 1 is 1.0
    if (const auto integer = item_of<std::int64_t>(value)) return static_cast<double>(*integer);
  }
  return {};
}

// The list as an array of T, if all of it is.
template <class T>
std::optional<ParameterValue> array_of(const document::List& list) {
  std::vector<T> result;
  for (const document::Value& value : list) {
    const std::optional<T> item = item_of<T>(value);
    if (!item) return {};
    result.push_back(*item);
  }
  return result;
}

}  // namespace

void ComponentReader::read_component(const Value& value) {
  ComponentDescription component{.where = errors_.where(value.line)};
  std::string parameters_file;
  int line = 0;
  std::vector<Field> fields{
      {"library",
       "The shared library that registers the class, as for a scheduler. Without it, the class "
       "must be in the component index or in `takt` itself.",
       [&](const Value& library) { read_library(library, component.library); }},
      {"component", "The component class, see `takt list components`.",
       into_checked(component.type, [&] { find_component(component.type, component.library); }),
       true},
      {"name", "The node's name. By default, the class names it. The full name must be unique.",
       into_node_name(component.name)},
      {"namespace", "The node's namespace, for example `/front`. By default, the root.",
       into_name_space(component.name_space)},
      {"parameters",
       "The node's parameters. Integers are taken for floating-point numbers (but by "
       "components of rclcpp, which refuse them as in ROS 2), in lists also for "
       "bytes, and an empty list for one of any type. A nested map is a prefix: `{a: {b: 1}}` sets "
       "the parameter `a.b`.",
       [&](const Value& parameters) { read_parameters(parameters, "", component); }},
      {"parameters_file",
       "A parameter file of ROS 2, with its rules; a relative path starts at the folder of this "
       "file. Of its sections, those hold that are for the node, which needs a `name`: first those "
       "with wildcards, then those with its name. What stands in `parameters` holds before all.",
       [&](const Value& file) {
         into(parameters_file)(file);
         line = file.line;
       }},
      {"remap", "Topic or service name in the code → the name to use instead.",
       each_in_map([&](const Value& topic) { read_remap(topic, component); })},
      {"log_level", "Lowest level that the node logs. By default, that of the process.",
       into(component.log_level, Words<LogLevel>{{"debug", LogLevel::debug},
                                                 {"info", LogLevel::info},
                                                 {"warn", LogLevel::warn},
                                                 {"error", LogLevel::error}})}};
  for (Field& field : serving_fields(component)) fields.push_back(std::move(field));
  read_map(value, "a component", fields);
  if (!parameters_file.empty()) {
    system_.parameter_files.push_back(beside(parameters_file));
    errors_.passes(line, [&] { add_parameters_of(system_.parameter_files.back(), component); });
  }
  add(std::move(component), value.line);
}

// The keys of how callbacks are served, for components as for nodes of programs.
std::vector<SystemReader::Field> ComponentReader::serving_fields(ComponentDescription& node) {
  return {{"executor",
           "A name in `executors`, or `default`. By default, the executor of its chain, else "
           "`default`.",
           into_executor(node.executor)},
          {"callback_groups",
           "Settings by name of the group. Each node has a group `default`; its code creates "
           "others.",
           each_in_map([&](const Value& group) { CallbackReader(file_).read_group(group, node); })},
          {"callbacks",
           "Settings by name of the callback: a timer's name, or the topic or service in the code. "
           "They take precedence over those of the group.",
           each_in_map([&](const Value& callback) {
             CallbackReader(file_).read_callback(callback, node);
           })},
          {"on_exception",
           "Reaction to an exception from a callback. `terminate`: the container stops. "
           "`remove_node`: the component's node is removed from its executors. `ignore`: the "
           "exception is only logged.",
           into(node.on_exception, {{"terminate", OnException::terminate},
                                    {"remove_node", OnException::remove_node},
                                    {"ignore", OnException::ignore}})}};
}

// The key of a node is its full name.
void ComponentReader::read_node(const Value& value) {
  ComponentDescription node{.where = errors_.where(value.line)};
  if (!is_describing()) {
    const std::string full = value.name.starts_with('/') ? value.name : "/" + value.name;
    const std::size_t end = full.rfind('/');
    into_node_name(node.name)({value.name, value.line, full.substr(end + 1)});
    if (end != 0) into_name_space(node.name_space)({value.name, value.line, full.substr(0, end)});
  }
  read_map(value, "a node of a program", serving_fields(node));
  add(std::move(node), value.line);
}

std::optional<ParameterValue> ComponentReader::parameter_value(const Value& value) {
  if (describes("`true` or `false`, integer, number, text, a list of one of these, or a map of "
                "them")) {
    return {};
  }
  const std::size_t errors = errors_.size();
  document::check_is_unambiguous(value, errors_);
  if (errors_.size() != errors) return {};
  if (const auto* list = std::get_if<document::List>(&value.content)) {
    std::optional<ParameterValue> array =
        array_of<std::string>(*list);  // an empty one is of any type
    if (!array) array = array_of<bool>(*list);
    if (!array) array = array_of<std::int64_t>(*list);
    if (!array) array = array_of<double>(*list);
    if (!array) refuse(value, "items of one type: numbers, texts, or true and false");
    return array;
  }
  const auto take = [](const auto& content) -> std::optional<ParameterValue> {
    using Content = std::decay_t<decltype(content)>;
    if constexpr (std::is_same_v<Content, std::monostate>)
      return {};
    else if constexpr (std::is_constructible_v<ParameterValue, Content>)
      return content;
    return {};
  };
  std::optional<ParameterValue> result = std::visit(take, value.content);
  if (!result) refuse(value, "a value, or leave it out");
  return result;
}

void ComponentReader::read_parameters(const Value& map, const std::string& prefix,
                                      ComponentDescription& component) {
  each_in_map([&](const Value& value) {
    const std::string name = prefix + value.name;
    if (std::holds_alternative<document::Map>(value.content)) {
      return read_parameters(value, name + ".", component);
    }
    const std::optional<ParameterValue> parameter = parameter_value(value);
    if (!parameter) return;
    component.parameter_lines.try_emplace(name, errors_.where(value.line));
    if (!component.parameters.try_emplace(name, *parameter).second) {  // "a.b", and "b" in "a"
      errors_.add(value.line, fmt::format("the parameter '{}' has two values", name),
                  "remove one of them");
    }
  })(map);
}

void ComponentReader::read_remap(const Value& value, ComponentDescription& component) {
  std::string topic;
  into_topic(topic)(value);
  component.remap.try_emplace(value.name, topic);
  component.remap_lines.try_emplace(value.name, errors_.where(value.line));
}

}  // namespace takt
