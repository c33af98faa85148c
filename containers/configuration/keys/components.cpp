// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_component(const Value& value) {
  ComponentDescription component{.where = errors_.where(value.line)};
  read_map(
      value, "a component",
      {{"library",
        "The shared library that registers the class, as for a scheduler. Without it, the "
        "component index tells which, or `takt` itself has the class.",
        [&](const Value& library) { read_library(library, component.library); }},
       {"component", "The class, see `takt list components`.",
        into_checked(component.type, [&] { find_component(component.type, component.library); }),
        true},
       {"name",
        "The node's name. Without it, the class's own. No two components have the same full "
        "name.",
        into_node_name(component.name)},
       {"namespace", "Such as `/front`. Without it, the root.",
        into_name_space(component.name_space)},
       {"executor",
        "A name in `executors`, or `default`. Without it, that of its chain, else `default`.",
        into_executor(component.executor)},
       {"parameters",
        "Its node's parameters. Items of a list are of one type. A map in it is a prefix: `{a: "
        "{b: 1}}` is the parameter `a.b`.",
        [&](const Value& parameters) { read_parameters(parameters, "", component); }},
       {"remap", "The topic or service as the code names it → the one to use.",
        each_in_map([&](const Value& topic) { read_remap(topic, component); })},
       {"callback_groups", "By name. Each node has a group `default`; others are made by its code.",
        each_in_map([&](const Value& group) { read_group(group, component); })},
       {"callbacks",
        "By name. A timer is called as in the code, a subscription, service or client as its "
        "topic or service there. What a callback has of its own comes before what its group has.",
        each_in_map([&](const Value& callback) { read_callback(callback, component); })},
       {"on_exception",
        "What follows an exception of a callback. `terminate`: ends the container. "
        "`remove_node`: takes the component's node from its executors. `ignore`: it is told, "
        "and nothing else.",
        into(component.on_exception, {{"terminate", OnException::terminate},
                                      {"remove_node", OnException::remove_node},
                                      {"ignore", OnException::ignore}})},
       {"log_level", "Of its node: what is below is not logged. Without it, the process's.",
        into(component.log_level, Words<LogLevel>{{"debug", LogLevel::debug},
                                                  {"info", LogLevel::info},
                                                  {"warn", LogLevel::warn},
                                                  {"error", LogLevel::error}})}});
  add(std::move(component), value.line);
}

// dlopen itself would look for a path in the current directory, and for a name in the system.
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

// A path as this file means it.
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
      errors_.add(value.line, fmt::format("the parameter '{}' has a value already", name),
                  "leave out one of the two");
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
  fields.push_back({"executor", "A name in `executors`, or `default`. Without it, the component's.",
                    into_executor(group.executor)});
  read_callback_map(value, "a callback group", fields, group.parameters);
  component.callback_groups.try_emplace(value.name, std::move(group));
}

void ConfigurationReader::read_callback(const Value& value, ComponentDescription& component) {
  if (describes("as [a callback group](#a-callback-group), without `executor`")) return;
  CallbackDescription callback{.where = errors_.where(value.line)};
  read_callback_map(value, "a callback", parameter_fields(callback.parameters),
                    callback.parameters);
  component.callbacks.try_emplace(value.name, std::move(callback));
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
  return {{"priority",
           "Larger is more urgent. Without it, that of its chain, else 0. For the schedulers "
           "`fixed_priority` and `chain_priority`.",
           into(parameters.priority)},
          {"deadline",
           "Not 0. From publication or due time to the end of the callback. For the schedulers "
           "`edf` and `least_laxity`; what is missed is counted, and told.",
           time(parameters.deadline)},
          {"period", "Not 0. The least time between two messages. Without it, a timer's own.",
           time(parameters.period)},
          {"budget",
           "Not 0, and not above deadline or period. How long an execution takes at the most, "
           "by the clock. More is an overrun.",
           time(parameters.budget)},
          {"criticality",
           "Larger matters more. Without it, the priority of its chain, or 0. For "
           "`chain_priority`.",
           into(parameters.criticality)},
          {"overrun",
           "What follows when a callback misses its deadline, runs longer than its budget, or "
           "is a timer that still runs at its next release; without it, `catch_up`. `catch_up`: "
           "of the releases that came meanwhile one is served at once. `skip`: none of them is; "
           "the timer goes on in phase. `abort`: the chain instance ends, and nobody receives "
           "what it has sent. `demote`: it runs after all others until it has ended once "
           "without. It is counted whatever follows.",
           into(parameters.overrun, overrun_policies())}};
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
