// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_reader.hpp"
#include "takt/containers/configuration/parameter_file.hpp"

namespace takt {
namespace {

// What the component's own `parameters` do not say.
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

}  // namespace

void ConfigurationReader::read_component(const Value& value) {
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

// How the callbacks of a node are served, of a component as of a program.
std::vector<SystemReader::Field> ConfigurationReader::serving_fields(ComponentDescription& node) {
  return {{"executor",
           "A name in `executors`, or `default`. By default, the executor of its chain, else "
           "`default`.",
           into_executor(node.executor)},
          {"callback_groups",
           "Settings by name of the group. Each node has a group `default`; its code creates "
           "others.",
           each_in_map([&](const Value& group) { read_group(group, node); })},
          {"callbacks",
           "Settings by name of the callback: a timer's name, or the topic or service in the code. "
           "They take precedence over those of the group.",
           each_in_map([&](const Value& callback) { read_callback(callback, node); })},
          {"on_exception",
           "Reaction to an exception from a callback. `terminate`: the container stops. "
           "`remove_node`: the component's node is removed from its executors. `ignore`: the "
           "exception is only logged.",
           into(node.on_exception, {{"terminate", OnException::terminate},
                                    {"remove_node", OnException::remove_node},
                                    {"ignore", OnException::ignore}})}};
}

// Its key is the full name.
void ConfigurationReader::read_node(const Value& value) {
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

// dlopen resolves a path from the current directory and a bare name in system folders only; the
// file's own folder comes first here.
void ConfigurationReader::read_library(const Value& value, std::string& library) {
  into(library)(value);
  if (library.empty()) return;
  const std::string path = beside(library);
  std::error_code too_long;  // for the name of a file
  if (library.find('/') != std::string::npos || std::filesystem::exists(path, too_long)) {
    library = path;
  }
  if (policy_ != nullptr) {
    library = policy_->permitted(library);
  } else {
    system_.libraries.push_back(real_library(library));
  }
}

// Paths in the file are relative to the file's folder.
std::string ConfigurationReader::beside(const std::string& path) const {
  return std::filesystem::absolute(errors_.file()).parent_path() / path;
}

void ConfigurationReader::read_parameters(const Value& map, const std::string& prefix,
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

void ConfigurationReader::read_remap(const Value& value, ComponentDescription& component) {
  std::string topic;
  into_topic(topic)(value);
  component.remap.try_emplace(value.name, topic);
  component.remap_lines.try_emplace(value.name, errors_.where(value.line));
}

void ConfigurationReader::read_group(const Value& value, ComponentDescription& component) {
  CallbackGroupDescription group{.where = errors_.where(value.line)};
  std::vector<Field> fields = parameter_fields(group.parameters);
  fields.push_back({"executor",
                    "A name in `executors`, or `default`. By default, the component's executor.",
                    into_executor(group.executor)});
  fields.push_back(waits_field(group.waits));
  read_callback_map(value, "a callback group", fields, group.parameters);
  component.callback_groups.try_emplace(value.name, std::move(group));
}

void ConfigurationReader::read_callback(const Value& value, ComponentDescription& component) {
  CallbackDescription callback{.where = errors_.where(value.line)};
  std::vector<Field> fields = parameter_fields(callback.parameters);
  fields.push_back(
      {"execution",
       "Processor time of one execution, for `takt analyze`. A duration is the longest; `{min: "
       "1ms, max: 4ms}` states the shortest, too.",
       into_execution(callback.execution)});
  fields.push_back(waits_field(callback.waits));
  fields.push_back({"arrival",
                    "How often it is called, if that is decided outside of this file: by other "
                    "programs, services, file descriptors, guard conditions. For `takt analyze`.",
                    into_arrival(callback.arrival)});
  fields.push_back({"outputs",
                    "When it publishes during an execution, for `takt analyze`: `end`, or `any`.",
                    into(callback.publishes_at_end, {{"end", true}, {"any", false}})});
  read_callback_map(value, "a callback", fields, callback.parameters);
  component.callbacks.try_emplace(value.name, std::move(callback));
}

SystemReader::Field ConfigurationReader::waits_field(std::optional<Nanoseconds>& waits) {
  return {"waits",
          "The most that one execution waits, in all: for a lock, a device, a reply, a sleep. For "
          "`takt analyze`: the thread runs nothing else meanwhile. By default, 0.",
          [this, &waits](const Value& value) { into_duration(waits.emplace(), [] {})(value); }};
}

SystemReader::Read ConfigurationReader::into_execution(
    std::optional<ExecutionDescription>& execution) {
  return [this, &execution](const Value& value) {
    ExecutionDescription described;
    const auto check = [&described] {
      if (described.longest == Nanoseconds::zero()) {
        throw Error("an execution takes some time", "write more than 0");
      }
      if (described.least > described.longest) {
        throw Error(fmt::format("its shortest execution, {}, is longer than its longest, {}",
                                to_string(described.least), to_string(described.longest)),
                    "exchange them");
      }
    };
    either(into_duration(described.longest, check), [&](const Value& map) {
      const std::size_t before = errors_.size();
      read_map(map, "an execution",
               {{"min", "The shortest. By default, 0.", into_duration(described.least, [] {})},
                {"max", "The longest.", into_duration(described.longest, [] {}), true}});
      if (errors_.size() == before && !is_describing()) errors_.passes(map.line, check);
    })(value);
    execution = described;
  };
}

SystemReader::Read ConfigurationReader::into_arrival(std::optional<ArrivalDescription>& arrival) {
  return [this, &arrival](const Value& value) {
    ArrivalDescription& described = arrival.emplace();
    const std::size_t before = errors_.size();
    read_map(value, "an arrival",
             {{"period", "The time from one to the next.", into_duration(described.period, [] {})},
              {"jitter", "The most by which each is late.", into_duration(described.jitter, [] {})},
              {"least_distance", "No two are closer, whatever the jitter.",
               into_duration(described.least_distance, [] {})},
              {"distances",
               "Instead of the other keys: the least time from the first of 2, 3, … arrivals in a "
               "row to the last of them, none less than the one before. Further ones follow.",
               into_distances(described.distances)}});
    if (is_describing() || errors_.size() != before) return;
    errors_.passes(value.line, [&] {
      if (described.distances.empty() == (described.period == Nanoseconds::zero())) {
        throw Error("an arrival has either a period or distances", "write one of them");
      }
    });
  };
}

SystemReader::Read ConfigurationReader::into_distances(std::vector<Nanoseconds>& distances) {
  return [this, &distances](const Value& value) {
    each_in_list([&](const Value& distance) {
      Nanoseconds read{0};
      into_duration(read, [] {})(distance);
      if (is_describing()) return;
      if (!distances.empty() && read < distances.back()) {
        errors_.add(distance.line, "a distance is less than the one before it",
                    "the first of more arrivals is not closer to the last one");
      }
      distances.push_back(read);
    })(value);
    if (is_describing() || distances.empty() || distances.back() > Nanoseconds::zero()) return;
    errors_.add(value.line, "any number of arrivals may come at once", "add a distance above 0");
  };
}

void ConfigurationReader::read_callback_map(const Value& value, std::string_view whose,
                                            const std::vector<Field>& fields,
                                            const CallbackParameters& parameters) {
  const std::size_t before = errors_.size();
  read_map(value, whose, fields);
  if (errors_.size() == before) errors_.passes(value.line, [&] { parameters.check(); });
}

std::vector<SystemReader::Field> ConfigurationReader::parameter_fields(
    CallbackParameters& parameters) {
  const auto time = [this](std::optional<Nanoseconds>& target) -> Read {
    return [this, &target](const Value& value) { into_duration(target.emplace(), [] {})(value); };
  };
  return {
      {"priority",
       "A larger number is more urgent. By default, what Takt assigns to callbacks of `chains`, "
       "else 0. For the schedulers `fixed_priority` and `chain_priority`; [which callback runs "
       "first](../explanation/priorities.md).",
       into(parameters.priority)},
      {"deadline",
       "Relative deadline of the callback's end, from the publication or a timer's due time. "
       "Not 0. For the schedulers `edf` and `least_laxity`. Misses are counted and reported.",
       time(parameters.deadline)},
      {"period", "Minimum time between two messages. Not 0. By default, the period of a timer.",
       time(parameters.period)},
      {"budget",
       "Maximum execution time of the callback, in wall-clock time. Not 0, and at most "
       "deadline and period. A longer execution is an overrun.",
       time(parameters.budget)},
      {"criticality",
       "A larger number is more critical. By default, the priority of its chain, else 0. For "
       "`chain_priority`.",
       into(parameters.criticality)},
      {"overrun",
       "Reaction when the callback misses its deadline, exceeds its budget, or is a timer that "
       "still runs at its next release; by default `catch_up`. `catch_up`: one of the missed "
       "releases is served at once. `skip`: missed releases are dropped, and the timer keeps "
       "its phase. `abort`: the chain instance ends, and its messages are not delivered. "
       "`demote`: the callback runs after all others until one execution stays in time. Every "
       "overrun is counted.",
       into(parameters.overrun, overrun_policies())},
      {"releases",
       "How many releases of a timer may wait; by default 1, and those that come due meanwhile are "
       "missed. With more, each is served, the oldest first; of those beyond, the oldest are "
       "missed, and counted. Of no effect on other callbacks.",
       into(parameters.releases, 1)}};
}

void ConfigurationReader::read_changes(const Value& value, CallbackParameterChanges& changes) {
  const auto each = [this](auto& target) {
    return each_in_map([this, &target](const Value& entry) {
      CallbackParameters& parameters = target[entry.name];
      read_callback_map(entry, "a callback", parameter_fields(parameters), parameters);
    });
  };
  read_map(value, "a node",
           {{"callback_groups", "Changes by name.", each(changes.callback_groups)},
            {"callbacks", "Changes by name.", each(changes.callbacks)}});
}

}  // namespace takt
