// The chains of a model, their assumptions, and the verdict on each.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/model/model_builder.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {
namespace {

// Messages that a coroutine sends after a `co_await` belong to the callback of its resumption.
bool is_coroutine(const ModelledProcess::Callback& callback) {
  const auto& of_node = callback.node->entities();
  return std::any_of(of_node.begin(), of_node.end(), [&](const std::shared_ptr<Entity>& other) {
    return other->name() == callback.entity->name() + "/resumed";
  });
}

}  // namespace

void ChainFinder::add_chains() {
  for (const PlannedChain& planned : chains_) {
    SystemModel::Chain chain{.name = planned.options.name, .deadline = planned.options.deadline};
    for (const ChainDescription& stated : description_.chains) {
      if (stated.options.name == chain.name) chain.allows_losses = stated.allows_losses;
    }
    if (measured_ != nullptr) {
      for (const MeasuredChain& seen : measured_->chains) {
        if (seen.name != chain.name) continue;
        chain.observed = seen.longest;
        if (measured_->lost_executions == 0) chain.came_through = seen.instances;
      }
    }
    std::vector<std::size_t> path;
    for (const auto& [node, name] : planned.path) {
      const auto callback =
          std::find_if(callbacks_.begin(), callbacks_.end(),
                       [&, &of = node, &called = name](const auto* candidate) {
                         return candidate->node == of && candidate->entity->name() == called;
                       });
      if (callback == callbacks_.end() && chain.why_not.empty()) {
        chain.why_not = fmt::format("'{}' has been unloaded", to_string(Chain::Step{node, name}));
      }
      if (!chain.why_not.empty()) continue;
      path.push_back(static_cast<std::size_t>(callback - callbacks_.begin()));
      chain.why_not = why_nothing_comes(path);
      if (path.size() == 1 && chain.why_not.empty()) chain.why_not = why_it_begins_before(path[0]);
      const auto& before = path.size() > 1 ? model_.system.callbacks[path[path.size() - 2]].outputs
                                           : std::vector<analysis::Output>{};
      const bool is_linked =
          path.size() == 1 || std::any_of(before.begin(), before.end(), [&](const auto& output) {
            return output.to == path.back();
          });
      if (is_linked && chain.why_not.empty()) chain.why_not = why_it_never_joins(path);
      if (is_linked || !chain.why_not.empty()) continue;
      if (!in_circle_.contains(path.back())) {
        chain.why_not = fmt::format(
            "the measured run has not shown that '{}' gets messages from "
            "the step before it",
            to_string(Chain::Step{node, name}));
        continue;
      }
      chain.why_not = fmt::format(
          "'{}' is on a circle of callbacks that send to each other: nothing is known "
          "of how often they run; state its `arrival`",
          to_string(Chain::Step{node, name}));
    }
    if (chain.why_not.empty() && !path.empty()) compare_instances(chain, path.back());
    chain.is_dropped = std::exchange(finds_dropped_, false) && !chain.why_not.empty();
    if (!path.empty()) chain.delay = delay_before(path.front());
    count_begun(path, chain);
    chain.index = model_.system.chains.size();
    if (chain.why_not.empty()) model_.system.chains.push_back({chain.name, std::move(path)});
    model_.chains.push_back(std::move(chain));
  }
}

// What has come through has ended with an execution of the last callback.
void ChainFinder::compare_instances(const SystemModel::Chain& chain, std::size_t last) const {
  const MeasuredCallback* const end = measured(last);
  if (end == nullptr || end->executions == 0) return;
  // By two clocks: a hundredth may be theirs.
  if (chain.observed != Nanoseconds::zero() &&
      chain.observed + chain.observed / 100 < end->least_execution) {
    refuse_model(
        *measured_, chain.name,
        fmt::format("its longest instance took {}, and each execution of '{}' at least {}",
                    to_string(chain.observed), end->name, to_string(end->least_execution)));
  }
  if (chain.came_through <= end->executions) return;
  refuse_model(*measured_, chain.name,
               fmt::format("{} of its instances came through, and '{}' was executed {} "
                           "times",
                           chain.came_through, end->name, end->executions));
}

void ChainFinder::count_begun(const std::vector<std::size_t>& path,
                              SystemModel::Chain& chain) const {
  const MeasuredCallback* const first = path.empty() ? nullptr : measured(path.front());
  if (first == nullptr || measured_->duration == Nanoseconds::zero()) return;
  chain.begun = first->executions;
  const Nanoseconds total = std::max(measured_->duration, measured_->total_duration);
  chain.runs = static_cast<std::uint64_t>(total / measured_->duration);
  chain.begun_a_second =
      static_cast<double>(first->executions) / std::chrono::duration<double>(total).count();
  chain.is_managed = std::any_of(path.begin(), path.end(), [&](std::size_t callback) {
    return dynamic_cast<const LifecycleNode*>(callbacks_[callback]->node.get()) != nullptr;
  });
}

// If a chain begins with a message, the instance begins when that message is sent.
analysis::Time ChainFinder::delay_before(std::size_t first) {
  analysis::Time longest = 0;
  for (const std::size_t from : topics_.senders(first)) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (output.to == first) longest = std::max(longest, output.delay);
    }
  }
  const Entity& entity = *callbacks_[first]->entity;
  const EntityKind kind = entity.kind();
  const bool receives =
      kind == EntityKind::subscription || kind == EntityKind::service || kind == EntityKind::client;
  if (!receives || !model_.system.callbacks[first].arrivals) return longest;
  const auto stated = description_.delays.find(entry_of(entity));
  if (stated != description_.delays.end()) {
    return std::max(longest, stated->second.longest.count());
  }
  assume_of(first, "as_declared",
            "messages from outside to {} are not on their way for longer than nothing: their topic "
            "has no `delay`");
  return longest;
}

// An instance begins where its first message is sent. So no run has instances that begin at a
// callback that gets messages only from callbacks of its own process.
std::string ChainFinder::why_it_begins_before(std::size_t first) {
  const std::vector<analysis::Callback>& all = model_.system.callbacks;
  if (all[first].arrivals) return {};
  for (const std::size_t from : topics_.senders(first)) {
    if (process_of(from) != process_of(first) || nothing_passes_.contains({from, first})) continue;
    if (callbacks_[first]->entity->kind() != EntityKind::subscription) {
      return fmt::format(
          "requests to services and their answers are no steps of a chain: begin the path behind "
          "'{}'",
          all[first].name.substr(1));
    }
    return fmt::format(
        "what comes to '{}' comes from '{}' in the same process, so no instance begins there: "
        "begin the path with '{}' or before it",
        all[first].name, all[from].name, all[from].name.substr(1));
  }
  return {};
}

// A join before the last callback of the path never sends if one of its inputs never comes.
std::string ChainFinder::why_it_never_joins(const std::vector<std::size_t>& path) {
  if (path.size() < 2) return {};
  const auto is_input = [&](std::size_t callback) {
    const auto& outputs = model_.system.callbacks[callback].outputs;
    return std::any_of(outputs.begin(), outputs.end(), [&](const analysis::Output& output) {
      return output.to == path.back() && output.waits;
    });
  };
  const std::size_t own = path[path.size() - 2];
  if (!is_input(own)) return {};
  const auto continues = [&](const PlannedChain& chain) {
    return std::any_of(chain.path.begin(), chain.path.end(), [&](const Chain::Step& step) {
      return step.first == callbacks_[path.back()]->node &&
             step.second == callbacks_[path.back()]->entity->name();
    });
  };
  const auto count = std::count_if(chains_.begin(), chains_.end(), continues);
  if (count > static_cast<std::ptrdiff_t>(JoiningInstances::kMost)) {
    return fmt::format("{} chains go through the join before '{}', and {} continue as one", count,
                       model_.system.callbacks[path.back()].name, JoiningInstances::kMost);
  }
  for (std::size_t other = 0; other < callbacks_.size(); ++other) {
    if (other == own || !is_input(other)) continue;
    if (const std::string why = why_it_never_runs(other); !why.empty()) {
      return fmt::format("a join before '{}' waits for '{}': {}",
                         model_.system.callbacks[path.back()].name,
                         model_.system.callbacks[other].name, why);
    }
  }
  return {};
}

// Why the callback gets no message, directly or through its senders. The graph is acyclic: cycles
// have been cut.
std::string ChainFinder::why_it_never_runs(std::size_t callback) {
  std::string why;
  if (model_.system.callbacks[callback].arrivals) return why_nothing_comes({callback});
  for (const auto& [link, reason] : nothing_passes_) {
    if (link.second != callback) continue;
    why = reason;
    finds_dropped_ = finds_dropped_ || is_dropped(link.first);
  }
  for (const std::size_t from : topics_.senders(callback)) {
    why = why_it_never_runs(from);
    if (why.empty()) return why_nothing_comes({callback});
  }
  return why.empty() ? why_nothing_comes({callback}) : why;
}

// Why a chain has no instances, up to the last callback of `path`; empty: it has some.
std::string ChainFinder::why_nothing_comes(const std::vector<std::size_t>& path) {
  const std::size_t index = path.back();
  const ModelledProcess::Callback& callback = *callbacks_[index];
  const std::string& name = model_.system.callbacks[index].name;
  if (is_dropped(index)) {
    finds_dropped_ = true;
    return why_dropped(index);
  }
  if (path.size() == 1 && !may_run_[index]) {
    return fmt::format("nothing comes to '{}': no callback of the file sends to it", name);
  }
  if (is_coroutine(callback)) {
    return fmt::format("'{}' is a coroutine: nobody knows when it goes on after a `co_await`",
                       name);
  }
  if (!callback.is_served) {
    return fmt::format("no executor of the file runs the group '{}' of '{}'",
                       callback.entity->group()->name(), name);
  }
  if (path.size() > 1) {
    const auto found = nothing_passes_.find({path[path.size() - 2], index});
    if (found != nothing_passes_.end()) return found->second;
  }
  const MeasuredCallback* const seen = measured(index);
  const bool has_run =
      seen != nullptr && (seen->executions != 0 || seen->longest_execution != Nanoseconds::zero());
  if (seen != nullptr && !has_run) {
    return fmt::format("'{}' did not run in the measured run", name);
  }
  if (dynamic_cast<const LifecycleNode*>(callback.node.get()) == nullptr) return {};
  const std::string& node = callback.node->fully_qualified_name();
  const auto is_it = [&](const LifecycleDescription::ManagedNode& managed) {
    return managed.name == node;
  };
  if (description_.lifecycle && std::any_of(description_.lifecycle->bring_up.begin(),
                                            description_.lifecycle->bring_up.end(), is_it)) {
    return {};
  }
  if (!has_run) {
    return fmt::format(
        "nobody brings '{}' up, so '{}' gets nothing: list it in `lifecycle: "
        "bring_up`",
        node, name);
  }
  assume_of(index, "brought_up_by_others",
            "somebody brings the node of {} up, as in the measured run", measured_source());
  return {};
}

// The executors that the bound depends on: those on the path, those that send to them, and those
// that delay them on their CPUs; where Linux throttles, all that share these CPUs.
std::set<std::size_t> AssumptionFinder::executors_of(const std::vector<std::size_t>& path) const {
  const analysis::System& system = model_.system;
  std::set<std::size_t> result;
  for (const std::size_t callback : path) result.insert(system.callbacks[callback].executor);
  const auto delays = [&](std::size_t other, std::size_t executor) {
    const auto &a = system.executors[other].share, &b = system.executors[executor].share;
    const auto before = analysis::rivals(system, executor);
    const auto& movers = system.executors[executor].movers;
    const auto pushers = analysis::pushers(system, executor);
    return std::find(before.begin(), before.end(), other) != before.end() ||
           std::find(pushers.begin(), pushers.end(), other) != pushers.end() ||
           (system.overheads.context_switch != 0 &&
            (std::find(movers.begin(), movers.end(), other) != movers.end() ||
             (system.executors[executor].reservation && system.executors[other].reservation))) ||
           (a && b && a->meets(*b) && system.for_realtime);
  };
  for (bool has_changed = true; std::exchange(has_changed, false);) {
    for (const analysis::Callback& from : system.callbacks) {
      for (const analysis::Output& output : from.outputs) {
        if (!result.contains(system.callbacks[output.to].executor)) continue;
        has_changed = result.insert(from.executor).second || has_changed;
      }
    }
    for (std::size_t other = 0; other < system.executors.size(); ++other) {
      if (std::none_of(result.begin(), result.end(),
                       [&](std::size_t executor) { return delays(other, executor); })) {
        continue;
      }
      has_changed = result.insert(other).second || has_changed;
    }
  }
  return result;
}

std::string_view to_string(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::unjudged:
      return "-";
    case Verdict::dropped:
      return "dropped";
    case Verdict::guaranteed:
      return "guaranteed";
    case Verdict::bounded_if:
      return "bounded if";
    case Verdict::not_shown:
      return "not shown";
    case Verdict::not_covered:
      return "not covered";
    case Verdict::may_lose:
      return "may lose some";
    case Verdict::no_bound:
      return "no bound";
    case Verdict::missed:
      return "missed";
    case Verdict::refuted:
      break;
  }
  return "model refuted";
}

namespace {

bool has(const SystemModel::Chain& chain, Assumption::State state) {
  return std::any_of(chain.assumptions.begin(), chain.assumptions.end(),
                     [&](const Assumption& assumption) { return assumption.state == state; });
}

// A measured latency above a bound without overheads refutes that overheads are zero.
bool refutes_overheads(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  return bound.bound && chain.observed > *bound.bound &&
         std::any_of(
             chain.assumptions.begin(), chain.assumptions.end(),
             [](const Assumption& assumption) { return assumption.id == "overheads_are_zero"; });
}

}  // namespace

// Allows for instances that are in transit at the begin and the end of each run, and for those
// before all nodes are active.
std::string why_lost_in_run(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  if (chain.came_through == 0 || bound.one_of == 0 || !bound.bound) return {};
  const double begun = static_cast<double>(chain.begun);
  const double on_the_way =
      static_cast<double>(chain.runs) *
          (2 + chain.begun_a_second * std::chrono::duration<double>(*bound.bound).count()) +
      (chain.is_managed ? begun / 10 : 0);
  const double served = static_cast<double>(chain.came_through) * static_cast<double>(bound.one_of);
  if (served + on_the_way >= begun) return {};
  return fmt::format("of {} instances that began in the measured run, {} came through", chain.begun,
                     chain.came_through);
}

std::vector<const Assumption*> missing(const SystemModel::Chain& chain,
                                       const ModelBounds::Chain& bound) {
  const bool has_overheads = !refutes_overheads(chain, bound);
  std::vector<const Assumption*> result;
  for (const Assumption& assumption : chain.assumptions) {
    const bool holds =
        assumption.state == Assumption::State::checked ||
        (assumption.state == Assumption::State::unchecked && !assumption.accepted.empty());
    if (!holds || (!has_overheads && assumption.id == "overheads_are_zero")) {
      result.push_back(&assumption);
    }
  }
  return result;
}

Verdict verdict(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  if (chain.is_dropped) return Verdict::dropped;
  const bool has_deadline = chain.deadline != Nanoseconds::zero();
  if (bound.bound && chain.simulated > *bound.bound) return Verdict::refuted;
  if (has_deadline && std::max(chain.observed, chain.simulated) > chain.deadline)
    return Verdict::missed;
  if (has(chain, Assumption::State::not_covered)) return Verdict::not_covered;
  if (has(chain, Assumption::State::refuted)) return Verdict::refuted;
  if (!bound.bound) return Verdict::no_bound;
  if (chain.observed > *bound.bound && !refutes_overheads(chain, bound)) return Verdict::refuted;
  if (!why_lost_in_run(chain, bound).empty()) return Verdict::refuted;
  if (!has_deadline) return Verdict::unjudged;
  if (*bound.bound > chain.deadline) return Verdict::not_shown;
  if (!bound.why_lossy.empty() && !chain.allows_losses) return Verdict::may_lose;
  return missing(chain, bound).empty() ? Verdict::guaranteed : Verdict::bounded_if;
}

std::string describe(const SystemModel::Chain& chain, const ModelBounds::Chain& bound) {
  const Verdict found = verdict(chain, bound);
  const auto accepted =
      std::count_if(chain.assumptions.begin(), chain.assumptions.end(),
                    [](const Assumption& assumption) { return !assumption.accepted.empty(); });
  if (found != Verdict::guaranteed || accepted == 0) return std::string(to_string(found));
  return fmt::format("{} ({} accepted)", to_string(found), accepted);
}

}  // namespace takt
