// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_plan.hpp"

#include <algorithm>
#include <unordered_map>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// Whether the file gives the callback a priority.
bool gives_priority(const ComponentDescription& component, const Entity& entity) {
  const auto gives = [](const auto& all, const std::string& name) {
    const auto found = all.find(name);
    return found != all.end() && found->second.parameters.priority.has_value();
  };
  return gives(component.callbacks, entity.name()) ||
         gives(component.callback_groups, entity.group()->name());
}

}  // namespace

std::vector<std::shared_ptr<Chain>> make_chains(ContainerSetting& setting,
                                                ComponentList& components) {
  std::vector<std::shared_ptr<Chain>> chains;
  if (!setting.errors.empty()) return chains;
  std::vector<std::shared_ptr<Node>> nodes;
  for (const auto& loaded : components.all()) nodes.push_back(loaded->node());
  // Groups that the file places on an executor stay there, with or without chains. With an
  // overriding type all groups do, so that chains do not change a comparison.
  const bool is_overridden = !setting.overrides.executor.empty() && !setting.overrides.is_merged();
  std::vector<const CallbackGroup*> placed;
  for (const auto& loaded : components.all()) {
    for (const auto& group : loaded->node()->groups()) {
      if (is_overridden || !loaded->description.executor.empty() ||
          !loaded->own_executor(*group).empty()) {
        placed.push_back(group.get());
      }
    }
  }
  Plan plan =
      make_plan(find_chains(setting.description, nodes, setting.errors), nodes, placed,
                setting.is_of_machine() ? setting.description.machine.cpus : available_cpus(),
                setting.description.priorities.value_or(PriorityMethod::picas));
  for (const PlannedChain& chain : plan.chains) {
    try {
      chains.push_back(Chain::create(chain.options, chain.path));
    } catch (const Error& error) {
      setting.errors.push_back(fmt::format("chain '{}': {}", chain.options.name, error.what()));
    }
  }
  components.set_plan(std::move(plan));
  return chains;
}

void assign(ContainerSetting& setting, ComponentList& components) {
  const Plan plan = components.plan();
  for (const Plan::Callback& callback : plan.callbacks) {
    const Node& node = *callback.node;
    const auto loaded = components.find(node.fully_qualified_name());
    const bool is_given = setting.description.priorities
                              ? gives_priority(loaded->description, *callback.entity)
                              : node.callback_parameters(*callback.entity).priority.has_value();
    if (callback.priority == 0 || is_given) continue;
    callback.node->set_callback_parameters(
        {.callbacks = {{callback.entity->name(), {.priority = callback.priority}}}});
  }
  for (const Plan::Executor& executor : plan.executors) {
    if (!setting.has_thread(executor.name)) {
      setting.description.threads.push_back({executor.thread, {}});
      // The CPUs are those of `machine`, which need not be this machine, see Guarantees::modelled.
      if (setting.is_of_machine() && !setting.is_simulated())
        setting.description.threads.back().attributes.affinity.clear();
    }
    const auto is_namesake = [&](const auto& known) { return known.name == executor.name; };
    if (std::none_of(setting.description.executors.begin(), setting.description.executors.end(),
                     is_namesake)) {
      setting.description.executors.push_back(
          {.name = executor.name, .type = "chain_aware", .threads = {executor.name}});
    }
  }
  std::unordered_map<const Node*, ComponentDescription*> unassigned;
  for (const auto& loaded : components.all()) {
    if (loaded->description.executor.empty())
      unassigned[loaded->node().get()] = &loaded->description;
  }
  for (const Plan::Callback& callback : plan.callbacks) {
    const auto component = unassigned.find(callback.node.get());
    if (component == unassigned.end() || callback.executor.empty()) continue;
    std::string& executor =
        component->second->callback_groups[callback.entity->group()->name()].executor;
    if (executor.empty()) executor = callback.executor;
  }
}

void check_listed_callbacks(ContainerSetting& setting, const ComponentList& components,
                            const ContainerExecutors& executors) {
  for (const ExecutorDescription& executor : setting.description.executors) {
    std::vector<std::string> listed = executor.order;
    if (!executor.trigger.one.empty()) listed.push_back(executor.trigger.one);
    if (listed.empty()) continue;
    std::vector<std::string> names;
    for (const Plan::Callback& callback : components.plan().callbacks) {
      if (executors.name_for(*callback.node, *callback.entity->group()) != executor.name) continue;
      names.push_back(to_string(Chain::Step{callback.node, callback.entity->name()}).substr(1));
    }
    for (const std::string& name : listed) {
      const std::string wanted = name.starts_with('/') ? name.substr(1) : name;
      if (std::find(names.begin(), names.end(), wanted) != names.end()) continue;
      setting.errors.push_back(fmt::format("{}: executor '{}' has no callback '{}'; {}",
                                           executor.where, executor.name, name,
                                           suggest(wanted, names)));
    }
  }
}

}  // namespace takt
