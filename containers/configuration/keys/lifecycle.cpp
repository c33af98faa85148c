// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_lifecycle(const Value& value) {
  LifecycleDescription& lifecycle = system_.lifecycle.emplace();
  lifecycle.where = errors_.where(value.line);
  read_map(
      value, "the lifecycle",
      {{"bring_up", "Nodes by their full names, in the order in which they come up.",
        each_in_list([&](const Value& node) {
          const std::string name = find_node(node);
          if (name.empty()) return;
          if (find_managed(lifecycle, name) != nullptr) {
            errors_.add(node.line, fmt::format("'{}' is brought up twice", name),
                        "list every node once");
          } else {
            lifecycle.bring_up.push_back({name, {}});
          }
        }),
        true},
       {"depends_on",
        "By the name of a node, those that are active while it is. They come before it in "
        "`bring_up`.",
        each_in_map([&](const Value& nodes) { read_dependencies(nodes, lifecycle); })},
       {"heartbeat", "From `10ms`. A process that has told nothing for so long is lost.",
        into_duration(lifecycle.heartbeat,
                      [&] {
                        if (lifecycle.heartbeat >= std::chrono::milliseconds(10)) return;
                        throw Error("a heartbeat is 10ms or more", "give it more time");
                      })},
       {"on_loss",
        "What follows when a node is lost. `deactivate_dependents`: those that depend on it are "
        "inactive until it is back, and active. `shutdown`: all of them are shut down. "
        "`report`: nothing else.",
        into(lifecycle.on_loss,
             {{"deactivate_dependents", LifecycleDescription::OnLoss::deactivate_dependents},
              {"shutdown", LifecycleDescription::OnLoss::shutdown},
              {"report", LifecycleDescription::OnLoss::report}})}});
  if (const Value* nodes = document::find(value, "bring_up"); document::is_empty_list(nodes)) {
    errors_.add(nodes->line, "the list of nodes to bring up is empty", "list at least one node");
  }
}

LifecycleDescription::ManagedNode* ConfigurationReader::find_managed(
    LifecycleDescription& lifecycle, std::string_view name) {
  const auto found = std::find_if(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                  [&](const auto& node) { return node.name == name; });
  return found != lifecycle.bring_up.end() ? &*found : nullptr;
}

// The full name of the component's node; "" and an error when there is none.
std::string ConfigurationReader::find_node(const Value& value) {
  std::string name;
  into(name)(value);
  if (name.empty()) return {};
  return find_node(value.line, name);
}

std::string ConfigurationReader::find_node(int line, const std::string& name) {
  const std::string full = name.starts_with('/') ? name : "/" + name;
  if (has_component(full)) return full;
  errors_.add(
      line, fmt::format("no component of this file is called '{}'", name),
      component_names().empty() ? "give components a 'name'" : suggest(full, component_names()));
  return {};
}

void ConfigurationReader::read_dependencies(const Value& value, LifecycleDescription& lifecycle) {
  if (describes("list, each text")) return;
  const std::string name = find_node(value.line, value.name);
  if (name.empty()) return;
  const auto managed = [&](int line, const std::string& node) {
    auto* found = find_managed(lifecycle, node);
    if (found == nullptr) {
      errors_.add(line, fmt::format("'{}' is not brought up", node), "list it under 'bring_up'");
    }
    return found;
  };
  auto* node = managed(value.line, name);
  each_in_list([&](const Value& item) {
    const std::string needed = find_node(item);
    if (needed.empty() || node == nullptr) return;
    const auto* before = managed(item.line, needed);
    if (before == nullptr) return;
    if (before == node) {
      errors_.add(item.line, fmt::format("'{}' depends on itself", name), "leave it out");
    } else if (before > node) {
      errors_.add(item.line,
                  fmt::format("'{}' comes up before '{}', which it depends on", name, needed),
                  "turn them round in 'bring_up'");
    }
    node->depends_on.push_back(needed);
  })(value);
}

}  // namespace takt
