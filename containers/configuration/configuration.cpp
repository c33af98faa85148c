// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "takt/containers/configuration/document.hpp"
#include "takt/containers/configuration/parameter_file.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/configuration/system_reader.hpp"

namespace takt {

ConfigurationError::ConfigurationError(std::vector<std::string> errors)
    : Error(fmt::format("{}", fmt::join(errors, "\n"))), errors_(std::move(errors)) {
}

ExecutorOptions options_of(const ExecutorDescription& executor) {
  return {.name = executor.name,
          .scheduler = executor.scheduler,
          .wait = executor.wait,
          .per = executor.per,
          .reentrant_threads = static_cast<std::size_t>(executor.reentrant_threads),
          .trigger = executor.trigger,
          .own = executor.own,
          .order = executor.order,
          .spin = executor.spin,
          .early_wake = executor.early_wake};
}

const OwnValues& own_values_of(const std::string& scheduler, const SystemDescription& system) {
  static const OwnValues none;
  const auto found = system.schedulers.find(scheduler);
  return found != system.schedulers.end() ? found->second : none;
}

bool limits_chains(const SystemDescription& system) {
  return std::any_of(system.chains.begin(), system.chains.end(),
                     [](const auto& chain) { return chain.options.concurrency != 0; });
}

const ThreadDescription* find_thread(const SystemDescription& system, std::string_view name) {
  const auto found =
      std::find_if(system.threads.begin(), system.threads.end(),
                   [&](const ThreadDescription& each) { return each.attributes.name == name; });
  return found != system.threads.end() ? &*found : nullptr;
}

std::string full_name(const ComponentDescription& component) {
  if (component.name.empty()) return {};
  return full_node_name(component.name_space, component.name);
}

bool uses(const ComponentDescription& component, const ExecutorDescription& executor) {
  return component.executor == executor.name ||
         (component.executor.empty() && executor.name == "default") ||
         std::any_of(component.callback_groups.begin(), component.callback_groups.end(),
                     [&](const auto& group) { return group.second.executor == executor.name; });
}

bool is_of_chain(const ExecutorDescription& executor, std::span<const ChainDescription> chains) {
  return std::any_of(chains.begin(), chains.end(), [&](const ChainDescription& chain) {
    return chain.options.name == executor.name;
  });
}

std::string noun_of(const ComponentDescription& component) {
  return component.type.empty() ? fmt::format("node '{}'", full_name(component))
                                : fmt::format("component '{}'", component.type);
}

LoadPolicy load_policy(const SystemDescription& process) {
  const std::string& container =
      process.components.empty() ? process.name : process.components.front().container;
  const auto found = process.loads.find(container);
  LoadPolicy policy = found != process.loads.end() ? found->second : LoadPolicy{};
  policy.libraries = process.libraries;
  if (!policy.is_given && !(process.dds && process.dds->security)) {
    policy.privileges = privileges();
  }
  return policy;
}

namespace {

constexpr const char* kOwnFile = "write a file of Takt's (see: takt reference config)";

// Launch files are often given by mistake, so the error says what they are for.
void refuse_launch_file(const std::string& path, const document::Errors& errors) {
  std::error_code none;
  const bool is_launch_file = path.ends_with(".py") || path.ends_with(".launch.xml") ||
                              path.ends_with(".xml") || path.ends_with(".launch.yaml");
  if (!is_launch_file || !std::filesystem::is_regular_file(path, none)) return;
  errors.fail(1, "this is a launch file of ROS 2, which starts processes",
              fmt::format("start it with ros2 launch; for a container, {}", kOwnFile));
}

void refuse_parameter_file(const document::Value& root, const document::Errors& errors) {
  if (document::find(root, "launch") != nullptr) {
    errors.fail(1, "this is a launch file of ROS 2, which starts processes",
                fmt::format("start it with ros2 launch; for a container, {}", kOwnFile));
  }
  if (!document::is_parameter_file(root)) return;
  errors.fail(1, "this is a parameter file of ROS 2, which describes no system",
              fmt::format("give it to a program, --ros-args --params-file {0}, or to a node that "
                          "runs, takt param load NODE {0}; to a component, write its values under "
                          "'parameters:'",
                          errors.file()));
}

}  // namespace

SystemDescription read_system(const std::string& path, const Settings& settings) {
  document::Errors errors(path);
  refuse_launch_file(path, errors);
  document::Value root = document::read(path, errors);
  refuse_parameter_file(root, errors);
  std::set<std::string> set;
  for (const Setting& setting : settings) {
    if (!set.insert(setting.path).second)
      throw Error(fmt::format("'{}' is set twice", setting.path), "leave one out");
    document::set(root, setting, errors);
  }
  const bool is_workload = document::is_json(path);
  SystemDescription system =
      is_workload ? read_workload(root, errors) : read_configuration(root, errors);
  errors.throw_if_any();
  system.file = path;
  if (is_workload) {
    system.name = std::filesystem::path(path).stem().string();
    for (ComponentDescription& component : system.components) component.container = system.name;
  }
  return system;
}

std::vector<SystemDescription> split(const SystemDescription& system, Composition composition) {
  std::vector<SystemDescription> processes;
  for (const ComponentDescription& component : system.components) {
    const std::string name = composition == Composition::per_node && !component.name.empty()
                                 ? component.name
                             : composition == Composition::single ? system.name
                                                                  : component.container;
    auto process = composition == Composition::per_node
                       ? processes.end()
                       : std::find_if(processes.begin(), processes.end(),
                                      [&](const auto& known) { return known.name == name; });
    if (process == processes.end()) {
      processes.push_back(system);
      process = processes.end() - 1;
      process->name = name;
      process->components.clear();
      process->keys.clear();
      if (processes.size() > 1) process->notes.clear();  // reported once
    }
    process->components.push_back(component);
  }
  if (processes.size() > 1 && !system.modes.empty()) {
    throw Error(fmt::format("modes are for one process, and there are {}", processes.size()),
                "choose another composition, or leave out `modes`", system.modes.front().where);
  }
  std::string manager;  // of the lifecycle: the process of the node that comes up first
  for (const SystemDescription& process : processes) {
    for (const ComponentDescription& component : process.components) {
      if (system.lifecycle && full_name(component) == system.lifecycle->bring_up.front().name) {
        manager = process.name;
      }
    }
  }
  for (SystemDescription& process : processes) {
    if (processes.size() > 1 && !process.dds) process.dds.emplace();
    if (processes.size() > 1) process.topic_lines.clear();  // other processes may have these topics
    process.is_split_off = composition == Composition::per_node;
    if (process.lifecycle) process.lifecycle->manager = manager;
    const auto is_used = [&process](const ExecutorDescription& executor) {
      return std::any_of(process.components.begin(), process.components.end(),
                         [&](const auto& component) { return uses(component, executor); });
    };
    std::erase_if(process.executors, [&](const auto& executor) {
      return !is_used(executor) && !is_of_chain(executor, process.chains);
    });
  }
  return processes;
}

}  // namespace takt
