// Constructs components, and checks what their descriptions name.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/containers/component_list.hpp"
#include "takt/containers/named_topics.hpp"

namespace takt {
namespace {

// Of a request as of a file: each is looked up among all names.
// Limit: errors about the names of a component's settings. At it: the rest is not looked for. Seen:
// the last error says so.
constexpr std::size_t kMostErrors = 100;

// Only a note: a launch file gives its remap rules to each of its components.
void note_unused_remaps(const Node& node, const std::vector<std::string>& unused) {
  // Limit: remap rules without a topic that a component's note names. At it: the others are
  // counted. Seen: the note.
  constexpr std::size_t kMostNamed = 3;
  if (unused.empty()) return;
  const auto named = static_cast<std::ptrdiff_t>(std::min(unused.size(), kMostNamed));
  std::string names =
      fmt::format("'{}'", fmt::join(unused.begin(), unused.begin() + named, "', '"));
  if (unused.size() > kMostNamed) {
    names += fmt::format(" and {} more", unused.size() - kMostNamed);
  }
  log(LogLevel::info, "note: {} has no topic {}: {} so far", node.fully_qualified_name(), names,
      unused.size() == 1 ? "its remap rule does nothing" : "their remap rules do nothing");
}

// Checks names against the constructed node: only its constructor creates timers, parameters and
// topics.
void check_names(const ComponentDescription& component, const Node& node,
                 std::vector<std::string>& errors) {
  // Returns false when there are enough errors.
  const auto add = [&](const SourceLine& where, std::string_view what, const std::string& name,
                       const std::string& what_to_do) {
    errors.push_back(
        Error(fmt::format("{} has no {} '{}'", noun_of(component), what, name), what_to_do, where)
            .what());
    if (errors.size() < kMostErrors) return true;
    errors.push_back(Error("more errors follow", "fix these first", where).what());
    return false;
  };
  const auto line = [&](const auto& lines, const std::string& name) {
    const auto found = lines.find(name);
    return found != lines.end() ? found->second : component.where;
  };
  for (const std::string& name : node.unused_parameters()) {
    const auto& where = line(component.parameter_lines, name);
    if (!add(where, "parameter", name, suggest(name, node.list_parameters().names))) return;
  }
  const std::vector<std::string> unused = node.unused_remaps();
  if (component.guest) {  // as a container of ROS 2 does, for which launch files are written
    note_unused_remaps(node, unused);
  } else {
    for (const std::string& name : unused) {
      if (!add(line(component.remap_lines, name), "topic to remap", name, "")) return;
    }
  }
  for (const std::string& name : node.timers_of_one_name()) {
    errors.push_back(Error(fmt::format("{} makes two timers called '{}'", noun_of(component), name),
                           "give each its own name in the code", component.where)
                         .what());
  }
  const auto check = [&](const auto& described, const auto& objects, std::string_view what) {
    std::set<std::string> names;
    for (const auto& object : objects) names.insert(object->name());
    for (const auto& [name, description] : described) {
      if (names.contains(name)) continue;
      const std::vector<std::string> valid(names.begin(), names.end());
      if (!add(description.where, what, name, suggest(name, valid))) return;
    }
  };
  check(component.callback_groups, node.groups(), "callback group");
  check(component.callbacks, node.entities(), "callback");
}

/// Of the first callback whose parameters are refused by themselves; or else `other`.
SourceLine line_of_refused(const ComponentDescription& component, const Node& node,
                           const SourceLine& other) {
  for (const auto& [name, callback] : component.callbacks) {
    try {
      node.check_callback_parameters({.callbacks = {{name, callback.parameters}}});
    } catch (const Error&) {
      return callback.where;
    }
  }
  return other;
}

// Sets the parameters before executors get the callbacks, so that no executor needs an update.
void set_parameters(const ComponentDescription& component, Node& node,
                    std::vector<std::string>& errors) {
  CallbackParameterChanges changes;
  std::string where = component.where;
  for (const auto& [name, group] : component.callback_groups) {
    changes.callback_groups[name] = group.parameters;
    where = group.where;
  }
  for (const auto& [name, callback] : component.callbacks) {
    changes.callbacks[name] = callback.parameters;
    where = callback.where;
  }
  try {
    node.set_callback_parameters(changes);
  } catch (const Error& error) {
    errors.push_back(Error(fmt::format("{}: {}", noun_of(component), error.what()), "",
                           line_of_refused(component, node, where))
                         .what());
  }
}

void check_topics(ContainerSetting& setting, const ComponentList& components) {
  std::vector<std::shared_ptr<Node>> nodes;
  for (const auto& loaded : components.all()) nodes.push_back(loaded->node());
  for (const Error& error : wrong_topics(setting.description, nodes))
    setting.errors.emplace_back(error.what());
}

std::unique_ptr<Component> construct(const ContainerSetting& setting,
                                     const ComponentDescription& component,
                                     const NodeOptions& options) {
  const ContainerOverrides& overrides = setting.overrides;
  if (component.type.empty()) {
    if (overrides.find_node) {
      return std::make_unique<Component>(Component{overrides.find_node(component)});
    }
    throw Error("a program makes it", "start that with TAKT_CONFIG=" + setting.description.file);
  }
  if (!overrides.on_making) return components().make(component.type, options);
  struct EndOfMaking {
    const std::function<void(std::string_view)>& on_making;
    ~EndOfMaking() { on_making(""); }
  };
  overrides.on_making(component.name.empty() ? component.type : component.name);
  const EndOfMaking end{overrides.on_making};
  return components().make(component.type, options);
}

}  // namespace

std::shared_ptr<Loaded> make_component(const ContainerSetting& setting,
                                       const ComponentDescription& component,
                                       std::vector<std::string>& errors) {
  NodeOptions options;
  options.name = component.name;
  options.name_space = component.name_space;
  options.parameters = component.parameters;
  options.remap = component.remap;
  options.qos = setting.description.topics;
  options.log_level = component.log_level;
  options.participant = setting.participant;
  options.guest = component.guest;
  options.is_only_constructed = setting.overrides.only_constructs;
  auto loaded = std::make_shared<Loaded>();
  loaded->description = component;
  options.clock = setting.overrides.clock;
  options.time_source = setting.time_source;
  options.end_container = setting.overrides.end;
  options.request_mode = [modes = setting.modes](std::string_view mode) {
    return modes->request(mode);
  };
  const std::size_t before = errors.size();
  const auto failed = [&](std::string_view why) {
    errors.push_back(
        Error(fmt::format("{} could not be made: {}", noun_of(component), why), "", component.where)
            .what());
  };
  try {
    loaded->component = construct(setting, component, options);
    check_names(component, *loaded->node(), errors);
    if (errors.size() == before) set_parameters(component, *loaded->node(), errors);
  } catch (const std::exception& error) {
    failed(error.what());
  } catch (...) {
    failed("it threw an object that is not a std::exception");
  }
  return errors.size() == before ? loaded : nullptr;
}

void make_components(ContainerSetting& setting, ComponentList& components) {
  const ContainerOverrides& overrides = setting.overrides;
  for (const ComponentDescription& component : setting.description.components) {
    // A node that the program has not made yet is left out.
    if (overrides.find_node && overrides.find_node(component) == nullptr) continue;
    if (const auto loaded = make_component(setting, component, setting.errors))
      components.add(loaded);
  }
  const std::vector<LoadedComponent> listed = components.listed();
  if (!listed.empty() && setting.errors.empty()) check_topics(setting, components);
  for (std::string& error : name_conflicts(listed)) setting.errors.push_back(std::move(error));
}

void complete(Loaded& loaded, ContainerSetting& setting) {
  std::call_once(loaded.completed, [&] {
    auto* const completing = dynamic_cast<Completing*>(loaded.node().get());
    const std::string failure = completing != nullptr ? completing->complete() : "";
    if (failure.empty()) return;
    setting.fail(fmt::format("{}: {}", loaded.node()->fully_qualified_name(), failure));
  });
}

}  // namespace takt
