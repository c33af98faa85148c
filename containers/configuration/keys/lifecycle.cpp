// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void LifecycleReader::read(const Value& value) {
  LifecycleDescription& lifecycle = system_.lifecycle.emplace();
  lifecycle.where = errors_.where(value.line);
  read_map(
      value, "the lifecycle",
      {{"bring_up", "Full names of the nodes, in the order in which they are brought up.",
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
        "For a node, the nodes that must be active while it is active. They must precede it in "
        "`bring_up`.",
        each_in_map([&](const Value& nodes) { read_dependencies(nodes, lifecycle); })},
       {"heartbeat", "At least `10ms`. A node without heartbeats for this time is lost.",
        into_duration(lifecycle.heartbeat,
                      [&] {
                        if (lifecycle.heartbeat >= std::chrono::milliseconds(10)) return;
                        throw Error("a heartbeat must be at least 10ms", "write a longer time");
                      })},
       {"on_loss",
        "Reaction to the loss of a node. `deactivate_dependents`: nodes that depend on it are "
        "deactivated until it is active again. `shutdown`: all nodes are shut down. `report`: the "
        "loss is only logged.",
        into(lifecycle.on_loss,
             {{"deactivate_dependents", LifecycleDescription::OnLoss::deactivate_dependents},
              {"shutdown", LifecycleDescription::OnLoss::shutdown},
              {"report", LifecycleDescription::OnLoss::report}})}});
  if (const Value* nodes = document::find(value, "bring_up"); document::is_empty_list(nodes)) {
    errors_.add(nodes->line, "the list of nodes to bring up is empty", "list at least one node");
  }
}

LifecycleDescription::ManagedNode* LifecycleReader::find_managed(LifecycleDescription& lifecycle,
                                                                 std::string_view name) {
  const auto found = std::find_if(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                  [&](const auto& node) { return node.name == name; });
  return found != lifecycle.bring_up.end() ? &*found : nullptr;
}

// The full name of the component's node; adds an error and returns "" if there is none.
std::string LifecycleReader::find_node(const Value& value) {
  std::string name;
  into(name)(value);
  if (name.empty()) return {};
  return find_node(value.line, name);
}

std::string LifecycleReader::find_node(int line, const std::string& name) {
  const std::string full = name.starts_with('/') ? name : "/" + name;
  if (file_.component_lines.contains(full)) return full;
  errors_.add(line, fmt::format("no component of this file is called '{}'", name),
              file_.component_names.empty() ? "give components a 'name'"
                                            : suggest(full, file_.component_names));
  return {};
}

void LifecycleReader::read_dependencies(const Value& value, LifecycleDescription& lifecycle) {
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
      errors_.add(item.line, fmt::format("'{}' depends on itself", name), "remove it");
    } else if (before > node) {
      errors_.add(item.line,
                  fmt::format("'{}' comes up before '{}', which it depends on", name, needed),
                  "swap them in 'bring_up'");
    }
    node->depends_on.push_back(needed);
  })(value);
}

}  // namespace takt
