// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/guarantees.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <typeinfo>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/base/library.hpp"
#include "takt/executors/isolated_executor.hpp"

namespace takt {
namespace {

/// The threads that executors of the type `isolated` give to a node, or would give to a node that
/// they do not have yet.
/// Thread safety: none. Real-time: no.
class ThreadsOfIsolated {
 public:
  explicit ThreadsOfIsolated(std::shared_ptr<Node> node) : node_(std::move(node)) {}

  /// nullopt: the executor does not isolate.
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
  // The groups asked for so far: executors create their children in this order.
  std::map<const IsolatedExecutor*, std::vector<const CallbackGroup*>> asked_;
};

struct Analyzed {
  SystemModel model;
  std::vector<ModelBounds::Chain> bounds;
};

/// Why the model is refuted; empty: it is not.
std::string why_refuted(const Analyzed& analyzed, std::size_t chain) {
  const SystemModel::Chain& seen = analyzed.model.chains[chain];
  for (const Assumption& assumption : seen.assumptions)
    if (assumption.state == Assumption::State::refuted) return assumption.text;
  const auto& bound = analyzed.bounds[chain].bound;
  if (!bound || seen.observed <= *bound) return {};
  return "it took " + to_string(seen.observed) + " in the measured run";
}

/// The chains that were guaranteed before, and are not any more.
std::vector<std::string> lost(const std::vector<PlannedChain>& chains, const Analyzed& before,
                              const Analyzed& after, const std::string& how, const char* remedy) {
  std::vector<std::string> errors;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const ChainOptions& options = chains[i].options;
    const auto is_kept = [&](const Analyzed& analyzed) {
      const ModelBounds::Chain& chain = analyzed.bounds[i];
      return chain.bound && *chain.bound <= options.deadline && chain.why_lossy.empty() &&
             why_refuted(analyzed, i).empty();
    };
    if (!is_kept(before) || is_kept(after)) continue;
    const ModelBounds::Chain& now = after.bounds[i];
    const std::string refuted = why_refuted(after, i);
    const std::string what = !now.bound               ? "take any time (" + now.why_not + ")"
                             : !now.why_lossy.empty() ? "lose some (" + now.why_lossy + ")"
                             : !refuted.empty() ? "take longer than its bound (" + refuted + ")"
                                                : "take " + to_string(*now.bound);
    errors.push_back(fmt::format(
        "{}, chain '{}' could {}, and its deadline is {}; without, the chain takes {} at "
        "most; "
        "{}",
        how, options.name, what, to_string(options.deadline), to_string(*before.bounds[i].bound),
        remedy));
  }
  return errors;
}

// Anybody may register a class in the namespace `takt`, so where its type is counts, not its name.
bool is_of_takt(const Node& node) {
  return is_in_takt(&typeid(node));
}

// In CPUs: 1 for each thread, or its utilisation for a SCHED_DEADLINE thread.
double capacity_of(const ContainerSetting& setting, const ExecutorDescription& executor) {
  if (executor.threads.empty()) return 1;
  double capacity = 0;
  for (const std::string& name : executor.threads) {
    const ThreadAttributes attributes = setting.thread(name);
    capacity += attributes.policy != ThreadPolicy::deadline
                    ? 1
                    : static_cast<double>(attributes.runtime.count()) /
                          static_cast<double>(attributes.period.count());
  }
  return capacity;
}

double utilisation_by(const Plan::Callback& callback) {
  const auto budget = callback.node->callback_parameters(*callback.entity).budget;
  if (!budget || callback.period == Nanoseconds::zero()) return 0;
  return static_cast<double>(budget->count()) / static_cast<double>(callback.period.count());
}

}  // namespace

std::vector<Plan::Callback> callbacks_of(const std::shared_ptr<Node>& node) {
  std::vector<Plan::Callback> callbacks;
  for (const auto& entity : node->entities()) {
    Nanoseconds period = entity->period();
    if (period == Nanoseconds::zero()) {
      period = node->callback_parameters(*entity).period.value_or(period);
    }
    callbacks.push_back({.node = node, .entity = entity, .period = period});
  }
  return callbacks;
}

void Guarantees::add_callbacks(const Loaded& loaded, ModelledProcess& process) const {
  const ComponentDescription& component = loaded.description;
  ModelledProcess::Member& member = process.nodes.emplace_back(ModelledProcess::Member{
      .node = loaded.node(),
      .executors = {},
      .where = component.where,
      .is_of_takt = is_of_takt(*loaded.node()),
      .ends_with_exceptions = component.on_exception == OnException::terminate});
  for (const auto& group : loaded.node()->groups()) {
    std::string executor = executors_.name_for(loaded, *group);
    auto& known = member.executors;
    if (std::find(known.begin(), known.end(), executor) == known.end()) {
      known.push_back(std::move(executor));
    }
  }
  ThreadsOfIsolated threads(loaded.node());
  for (const auto& group : loaded.node()->groups()) {  // place() adds these first
    if (loaded.own_executor(*group).empty()) continue;
    threads.find(*executors_.find(executors_.name_for(loaded, *group)).executor, group);
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
    std::string executor = executors_.name_for(loaded, its_group);
    const bool is_served =
        its_group.automatically_add_to_executor() || !loaded.own_executor(its_group).empty();
    auto thread = threads.find(*executors_.find(executor).executor, entity->group());
    process.callbacks.push_back({.node = loaded.node(),
                                 .entity = entity,
                                 .executor = std::move(executor),
                                 .described = std::move(described),
                                 .thread = std::move(thread),
                                 .is_served = is_served});
  }
}

ModelledProcess Guarantees::modelled() const {
  ModelledProcess process{.name = setting_.description.name};
  for (const auto& running : executors_.running()) {
    if (running->is_own) continue;
    process.executors.push_back(running->description);
    if (std::string note = running->note(); !note.empty()) process.notes.push_back(std::move(note));
  }
  const std::vector<Plan::Executor> planned = components_.plan().executors;
  for (const ThreadDescription& entry : setting_.description.threads) {
    process.threads.push_back(entry.attributes);
    const auto assigned = std::find_if(planned.begin(), planned.end(), [&](const auto& executor) {
      return entry.where.empty() && executor.name == entry.attributes.name;
    });
    if (assigned != planned.end()) process.threads.back().affinity = assigned->thread.affinity;
  }
  for (const auto& loaded : components_.all()) add_callbacks(*loaded, process);
  return process;
}

std::map<std::string, double> Guarantees::utilisation(const Loaded* more) const {
  std::map<std::string, double> result;
  const Plan plan = components_.plan();
  for (const Plan::Callback& each : plan.callbacks)
    result[executors_.name_for(*each.node, *each.entity->group())] += utilisation_by(each);
  if (more == nullptr) return result;
  for (const Plan::Callback& each : callbacks_of(more->node()))
    result[executors_.name_for(*more, *each.entity->group())] += utilisation_by(each);
  return result;
}

Guarantees::Errors Guarantees::too_much(const Loaded* more) const {
  Errors errors;
  const std::map<std::string, double> all = utilisation(more);
  for (const ExecutorDescription& executor : executors_.described()) {
    const auto found = all.find(executor.name);
    if (found == all.end() || executors().traits(executor.type).isolates)
      continue;  // a thread for each node or group
    const double capacity = capacity_of(setting_, executor);
    const double utilisation = found->second;
    if (utilisation <= capacity) continue;
    errors.push_back(fmt::format(
        "{}: the budgets of the callbacks of executor '{}' are {:.0f} % of its {}; give some of "
        "them to another executor, or lower their rates",
        executor.where.empty() ? setting_.description.file : executor.where, executor.name,
        100 * utilisation / capacity,
        capacity < 1 || capacity != std::floor(capacity)
            ? "reservation"
            : counted(std::max<std::size_t>(executor.threads.size(), 1), "thread")));
  }
  return errors;
}

Guarantees::Errors Guarantees::lost_by(const Loaded& loaded) const {
  ModelledProcess with = modelled();
  add_callbacks(loaded, with);
  return lost_by(with, "with '" + loaded.node()->fully_qualified_name() + "'",
                 "give the component another executor, a lower priority, or a smaller "
                 "budget");
}

Guarantees::Errors Guarantees::lost_by(const Changes& changes) const {
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
  return lost_by(with, "with these parameters",
                 "change those of others, too, or the deadline in the file");
}

Guarantees::Errors Guarantees::lost_by(const ModelledProcess& with, const std::string& how,
                                       const char* remedy) const {
  const auto has_deadline = [](const PlannedChain& chain) {
    return chain.options.deadline != Nanoseconds::zero();
  };
  const std::vector<PlannedChain> chains = components_.plan().chains;
  if (std::none_of(chains.begin(), chains.end(), has_deadline)) return {};
  std::optional<MeasuredModel> measured;
  if (!setting_.description.model.empty())
    measured = read_measured_model(setting_.description.model);
  Errors errors;
  for (std::size_t mode = 0; mode < setting_.modes->all().size(); ++mode) {
    const auto analyzed = [&](const ModelledProcess& process) {
      const ModelledProcess in_mode = setting_.modes->modelled(mode, process);
      SystemModel model = make_system_model(setting_.description, chains, {&in_mode, 1},
                                            measured ? &*measured : nullptr, facts_of_kernel());
      auto bounds = analyze(model).chains;
      return Analyzed{std::move(model), std::move(bounds)};
    };
    const std::string when =
        mode == 0 ? how
                  : fmt::format("{}, in the mode '{}'", how, setting_.modes->all()[mode].name);
    for (std::string& error : lost(chains, analyzed(modelled()), analyzed(with), when, remedy)) {
      errors.push_back(std::move(error));
    }
  }
  return errors;
}

}  // namespace takt
