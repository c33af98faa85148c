// The chains of a container, and the check that its executors are not overloaded.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/containers/container_parts.hpp"
#include "takt/containers/modes.hpp"
#include "takt/executors/isolated_executor.hpp"

namespace takt {
namespace {

/// The threads that executors which isolate give to a node, or would give to one that they do not
/// have yet.
/// Thread safety: none. Real-time: no.
class ThreadsOfIsolated {
 public:
  explicit ThreadsOfIsolated(std::shared_ptr<Node> node) : node_(std::move(node)) {}

  /// nullopt: this one does not isolate.
  std::optional<ModelledProcess::Callback::Thread> find(
      const Executor& executor, const std::shared_ptr<CallbackGroup>& group) {
    const auto* const isolated = dynamic_cast<const IsolatedExecutor*>(&executor);
    if (isolated == nullptr) return {};
    auto& known = asked_[isolated];
    auto place = std::find(known.begin(), known.end(), isolated->unit_of(*group));
    if (place == known.end()) place = known.insert(place, isolated->unit_of(*group));
    auto [index, attributes] =
        isolated->thread_of(node_, group, static_cast<std::size_t>(place - known.begin()));
    return ModelledProcess::Callback::Thread{index, std::move(attributes)};
  }

 private:
  const std::shared_ptr<Node> node_;
  // What they have been asked for, in this order: they make children in it.
  std::map<const IsolatedExecutor*, std::vector<const CallbackGroup*>> asked_;
};

// Whether CPUs are those of `machine`, and not those of this process: it is analysed or simulated.
bool is_of_machine(const SystemDescription& description, const ContainerOverrides& overrides) {
  return !description.machine.cpus.empty() &&
         (overrides.only_constructs || overrides.execution_model != nullptr);
}

// Whether the file does.
bool gives_priority(const ComponentDescription& component, const Entity& entity) {
  const auto gives = [](const auto& all, const std::string& name) {
    const auto found = all.find(name);
    return found != all.end() && found->second.parameters.priority.has_value();
  };
  return gives(component.callbacks, entity.name()) ||
         gives(component.callback_groups, entity.group()->name());
}

/// The chains that were guaranteed before, and are not any more.
std::vector<std::string> lost(const std::vector<PlannedChain>& chains,
                              const std::vector<ModelBounds::Chain>& before,
                              const std::vector<ModelBounds::Chain>& after, const std::string& how,
                              const char* remedy) {
  std::vector<std::string> errors;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const ChainOptions& options = chains[i].options;
    const auto is_kept = [&](const ModelBounds::Chain& chain) {
      return chain.bound && *chain.bound <= options.deadline && chain.why_lossy.empty();
    };
    if (!is_kept(before[i]) || is_kept(after[i])) continue;
    const std::string what = !after[i].bound ? "take any time (" + after[i].why_not + ")"
                             : !after[i].why_lossy.empty()
                                 ? "lose some (" + after[i].why_lossy + ")"
                                 : "take " + to_string(*after[i].bound);
    errors.push_back(fmt::format(
        "{}, chain '{}' could {}, and its deadline is {}; without, the chain takes {} at "
        "most; "
        "{}",
        how, options.name, what, to_string(options.deadline), to_string(*before[i].bound), remedy));
  }
  return errors;
}

}  // namespace

void Container::make_chains() {
  if (!errors_.empty()) return;
  std::vector<std::shared_ptr<Node>> nodes;
  for (const auto& loaded : loaded_components()) nodes.push_back(loaded->node());
  // What the file places, it places without chains, too; and so does an overriding type, so that
  // chains change no comparison.
  const bool is_overridden = !overrides_.executor.empty() && !overrides_.is_merged();
  std::vector<const CallbackGroup*> placed;
  for (const auto& loaded : loaded_components()) {
    for (const auto& group : loaded->node()->groups()) {
      if (is_overridden || !loaded->description.executor.empty() ||
          !loaded->own_executor(*group).empty()) {
        placed.push_back(group.get());
      }
    }
  }
  Plan plan = make_plan(
      find_chains(description_, nodes, errors_), nodes, placed,
      is_of_machine(description_, overrides_) ? description_.machine.cpus : available_cpus(),
      description_.priorities.value_or(PriorityMethod::picas));
  for (const PlannedChain& chain : plan.chains) {
    try {
      chains_.push_back(Chain::create(chain.options, chain.path));
    } catch (const Error& error) {
      errors_.push_back(fmt::format("chain '{}': {}", chain.options.name, error.what()));
    }
  }
  shared_.lock()->plan = std::move(plan);
}

// Applies Takt's assignments where the file gives no value. What it says of `priorities` precedes
// the code's own ones.
void Container::assign() {
  const Plan plan = this->plan();
  for (const Plan::Callback& callback : plan.callbacks) {
    const Node& node = *callback.node;
    const auto loaded = shared_.lock()->find(node.fully_qualified_name());
    const bool is_given = description_.priorities
                              ? gives_priority(loaded->description, *callback.entity)
                              : node.callback_parameters(*callback.entity).priority.has_value();
    if (callback.priority == 0 || is_given) continue;
    callback.node->set_callback_parameters(
        {.callbacks = {{callback.entity->name(), {.priority = callback.priority}}}});
  }
  for (const Plan::Executor& executor : plan.executors) {
    if (!has_thread(executor.name)) {
      description_.threads.push_back({executor.thread, {}});
      // Of a machine that need not be here, see modelled().
      if (is_of_machine(description_, overrides_) && overrides_.execution_model == nullptr)
        description_.threads.back().attributes.affinity.clear();
    }
    const auto is_namesake = [&](const auto& known) { return known.name == executor.name; };
    if (std::none_of(description_.executors.begin(), description_.executors.end(), is_namesake)) {
      description_.executors.push_back(
          {.name = executor.name, .type = "chain_aware", .threads = {executor.name}});
    }
  }
  std::unordered_map<const Node*, ComponentDescription*> unassigned;
  for (const auto& loaded : loaded_components()) {
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

// Checks that the callbacks named by executors exist.
void Container::check_listed_callbacks() {
  for (const ExecutorDescription& executor : description_.executors) {
    std::vector<std::string> listed = executor.order;
    if (!executor.trigger.one.empty()) listed.push_back(executor.trigger.one);
    if (listed.empty()) continue;
    std::vector<std::string> names;
    for (const Plan::Callback& callback : plan().callbacks) {
      if (executor_of(*callback.node, *callback.entity->group()) != executor.name) continue;
      names.push_back(to_string(Chain::Step{callback.node, callback.entity->name()}).substr(1));
    }
    for (const std::string& name : listed) {
      const std::string wanted = name.starts_with('/') ? name.substr(1) : name;
      if (std::find(names.begin(), names.end(), wanted) != names.end()) continue;
      errors_.push_back(fmt::format("{}: executor '{}' has no callback '{}'; {}", executor.where,
                                    executor.name, name, suggest(wanted, names)));
    }
  }
}

std::string Container::executor_of(const Node& node, const CallbackGroup& group) const {
  return executor_of(*shared_.lock(), node, group);
}

std::string Container::executor_of(const Shared& shared, const Node& node,
                                   const CallbackGroup& group) const {
  if (overrides_.is_merged()) return overrides_.executor;
  for (const auto& loaded : shared.components) {
    if (loaded->node().get() != &node) continue;
    const std::string own = loaded->own_executor(group);
    if (!own.empty()) return own;
    if (!loaded->description.executor.empty()) return loaded->description.executor;
  }
  return kDefaultExecutor;
}

double Container::utilisation_of(const std::string& executor) const {
  return utilisation_of(*shared_.lock(), executor);
}

double Container::utilisation_of(const Shared& shared, const std::string& executor) const {
  double utilisation = 0;
  for (const Plan::Callback& callback : shared.plan.callbacks) {
    const auto budget = callback.node->callback_parameters(*callback.entity).budget;
    if (!budget || callback.period == Nanoseconds::zero() ||
        executor_of(shared, *callback.node, *callback.entity->group()) != executor) {
      continue;
    }
    utilisation +=
        static_cast<double>(budget->count()) / static_cast<double>(callback.period.count());
  }
  return utilisation;
}

// In CPUs: 1 for each thread, or its utilisation for a SCHED_DEADLINE thread.
double Container::capacity_of(const ExecutorDescription& executor) const {
  if (executor.threads.empty()) return 1;
  double capacity = 0;
  for (const std::string& name : executor.threads) {
    const ThreadAttributes attributes = thread(name);
    capacity += attributes.policy != ThreadPolicy::deadline
                    ? 1
                    : static_cast<double>(attributes.runtime.count()) /
                          static_cast<double>(attributes.period.count());
  }
  return capacity;
}

// Of a component that may not be in the list yet.
std::string Container::executor_of(const Loaded& loaded, const CallbackGroup& group) const {
  const std::string own = loaded.own_executor(group);
  return overrides_.is_merged()                 ? overrides_.executor
         : !own.empty()                         ? own
         : !loaded.description.executor.empty() ? loaded.description.executor
                                                : kDefaultExecutor;
}

void Container::add_callbacks(const Loaded& loaded, ModelledProcess& process) const {
  const ComponentDescription& component = loaded.description;
  ModelledProcess::Member& member = process.nodes.emplace_back(ModelledProcess::Member{
      .node = loaded.node(),
      .executors = {},
      .where = component.where,
      .is_of_takt = component.library.empty() && component.type.starts_with("takt::"),
      .ends_with_exceptions = component.on_exception == OnException::terminate});
  for (const auto& group : loaded.node()->groups()) {
    std::string executor = executor_of(loaded, *group);
    auto& known = member.executors;
    if (std::find(known.begin(), known.end(), executor) == known.end()) {
      known.push_back(std::move(executor));
    }
  }
  ThreadsOfIsolated threads(loaded.node());
  for (const auto& group : loaded.node()->groups()) {  // these come first, see place()
    if (loaded.own_executor(*group).empty()) continue;
    threads.find(*executor_for(executor_of(loaded, *group)).executor, group);
  }
  for (const auto& entity : loaded.node()->entities()) {
    const auto found = component.callbacks.find(entity->name());
    CallbackDescription described =
        found != component.callbacks.end() ? found->second : CallbackDescription{};
    const auto group = component.callback_groups.find(entity->group()->name());
    if (!described.waits && group != component.callback_groups.end()) {
      described.waits = group->second.waits;
    }
    const CallbackGroup& its_group = *entity->group();
    std::string executor = executor_of(loaded, its_group);
    const bool is_served =
        its_group.automatically_add_to_executor() || !loaded.own_executor(its_group).empty();
    auto thread = threads.find(*executor_for(executor).executor, entity->group());
    process.callbacks.push_back({.node = loaded.node(),
                                 .entity = entity,
                                 .executor = std::move(executor),
                                 .described = std::move(described),
                                 .thread = std::move(thread),
                                 .is_served = is_served});
  }
}

ModelledProcess Container::modelled() const {
  ModelledProcess process{.name = description_.name};
  for (const auto& running : *executors_) {
    if (!running->is_own) process.executors.push_back(running->description);
  }
  const std::vector<Plan::Executor> planned = plan().executors;
  for (const ThreadDescription& entry : description_.threads) {
    process.threads.push_back(entry.attributes);
    const auto assigned = std::find_if(planned.begin(), planned.end(), [&](const auto& executor) {
      return entry.where.empty() && executor.name == entry.attributes.name;
    });
    if (assigned != planned.end()) process.threads.back().affinity = assigned->thread.affinity;
  }
  for (const auto& loaded : loaded_components()) add_callbacks(*loaded, process);
  return process;
}

// No scheduling order can serve callbacks that need more time than the executor's threads have.
Container::Errors Container::too_much_for_executors(const Shared& shared) const {
  Errors errors;
  std::vector<ExecutorDescription> all = description_.executors;
  if (needs_default_executor()) all.push_back({.name = kDefaultExecutor});  // of no entry
  for (const ExecutorDescription& executor : all) {
    if (executors().traits(executor.type).isolates) continue;  // a thread each
    const double capacity = capacity_of(executor);
    const double utilisation = utilisation_of(shared, executor.name);
    if (utilisation <= capacity) continue;
    errors.push_back(fmt::format(
        "{}: the budgets of the callbacks of executor '{}' are {:.0f} % of its {}; give some of "
        "them to another executor, or lower their rates",
        executor.where.empty() ? description_.file : executor.where, executor.name,
        100 * utilisation / capacity,
        capacity < 1 || capacity != std::floor(capacity)
            ? "reservation"
            : counted(std::max<std::size_t>(executor.threads.size(), 1), "thread")));
  }
  return errors;
}

// The chains that would not be guaranteed any more with this component, but are without it.
Container::Errors Container::lost_guarantees(const Loaded& loaded) const {
  ModelledProcess with = modelled();
  add_callbacks(loaded, with);
  return lost_guarantees(with, "with '" + loaded.node()->fully_qualified_name() + "'",
                         "give the component another executor, a lower priority, or a smaller "
                         "budget");
}

void Container::change_parameters(const std::string& text) {
  const Looks::Look look = shared_.lock()->looks.begin();
  std::vector<std::pair<std::shared_ptr<Node>, CallbackParameterChanges>> changes;
  std::vector<std::string> names;
  for (const LoadedComponent& loaded : components()) names.push_back(loaded.name);
  for (auto& [name, of_node] : read_parameter_changes(text)) {
    const std::string full = name.starts_with('/') ? name : "/" + name;
    const std::shared_ptr<Loaded> loaded = shared_.lock()->find(full);
    if (loaded == nullptr) {
      throw Error(fmt::format("no component is called '{}'", full), suggest(full, names));
    }
    loaded->node()->check_callback_parameters(of_node);
    changes.emplace_back(loaded->node(), std::move(of_node));
  }
  const Errors errors = lost_guarantees(changes);
  if (!errors.empty()) throw ConfigurationError(errors);
  for (const auto& [node, of_node] : changes) node->set_callback_parameters(of_node);
  changed("parameters of callbacks have changed");
}

// The same, if the callbacks of these nodes get other parameters.
Container::Errors Container::lost_guarantees(
    const std::vector<std::pair<std::shared_ptr<Node>, CallbackParameterChanges>>& changes) const {
  ModelledProcess with = modelled();
  for (ModelledProcess::Callback& callback : with.callbacks) {
    for (const auto& [node, of_node] : changes) {
      if (node != callback.node) continue;
      const auto named = [](const auto& all, const std::string& name) {
        const auto found = all.find(name);
        return found != all.end() ? found->second : CallbackParameters{};
      };
      const CallbackGroup& group = *callback.entity->group();
      callback.changed = named(of_node.callbacks, callback.entity->name())
                             .or_else(callback.entity->parameters())
                             .or_else(named(of_node.callback_groups, group.name()))
                             .or_else(group.parameters());
    }
  }
  return lost_guarantees(with, "with these parameters",
                         "change those of others, too, or the deadline in the file");
}

Container::Errors Container::lost_guarantees(const ModelledProcess& with, const std::string& how,
                                             const char* remedy) const {
  const auto has_deadline = [](const PlannedChain& chain) {
    return chain.options.deadline != Nanoseconds::zero();
  };
  const std::vector<PlannedChain> chains = plan().chains;
  if (std::none_of(chains.begin(), chains.end(), has_deadline)) return {};
  std::optional<MeasuredModel> measured;
  if (!description_.model.empty()) measured = read_measured_model(description_.model);
  Errors errors;
  for (std::size_t mode = 0; mode < modes_->all().size(); ++mode) {
    const auto bounds = [&](const ModelledProcess& process) {
      const ModelledProcess in_mode = modes_->modelled(mode, process);
      return analyze(make_system_model(description_, chains, {&in_mode, 1},
                                       measured ? &*measured : nullptr))
          .chains;
    };
    const std::string when =
        mode == 0 ? how : fmt::format("{}, in the mode '{}'", how, modes_->all()[mode].name);
    for (std::string& error : lost(chains, bounds(modelled()), bounds(with), when, remedy)) {
      errors.push_back(std::move(error));
    }
  }
  return errors;
}

}  // namespace takt
