// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/system_model.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/nodes/callback_info.hpp"
#include "takt/sched/ranks.hpp"

namespace takt {

CallbackParameters ModelledProcess::Callback::parameters() const {
  return changed ? *changed : node->callback_parameters(*entity);
}

using analysis::ArrivalCurve;
using analysis::kUnbounded;

namespace {

// Blocking longer than this is for something that nobody has described. Locks of the library block
// for less.
constexpr Nanoseconds kShortWait = std::chrono::microseconds(100);

/// The name that clients and action servers give to their timers: "/arm/move" → "arm_move".
std::string flat_name_of(std::string name) {
  name.erase(0, std::min(name.find_first_not_of("/~"), name.size()));
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

// Whether the timer is an action server's, for results that nobody has asked for long enough: the
// library cancels it at once, and releases it when results expire.
bool is_expiry(const Entity& entity, const Node& node) {
  const auto* const timer = dynamic_cast<const Timer*>(&entity);
  if (timer == nullptr || !timer->is_canceled()) return false;
  const auto& all = node.entities();
  return std::any_of(all.begin(), all.end(), [&](const auto& other) {
    const std::size_t end = other->name().rfind("/_action/get_result");
    return other->kind() == EntityKind::service && end != std::string::npos &&
           entity.name() == flat_name_of(other->name().substr(0, end)) + "_expiry";
  });
}

/// How long work takes on a CPU of that speed. All times of a callback are work, but for what the
/// clock measures: `waits`, and a `budget`, whose promise is the same on each CPU.
analysis::Time by_clock(Nanoseconds work, double speed) {
  return whole_time(static_cast<double>(work.count()) / speed);
}

Nanoseconds work_in(Nanoseconds time, double speed) {
  return Nanoseconds(static_cast<Nanoseconds::rep>(static_cast<double>(time.count()) * speed));
}

}  // namespace

// ---- Callbacks ----

// Whether the timer is a client's, for requests that get no answer: the library cancels it at once,
// and its period means nothing. A user's timer counts by its period, whatever its name.
bool ModelBuilder::is_timeout(const Entity& entity) const {
  const auto* const timer = dynamic_cast<const Timer*>(&entity);
  if (timer == nullptr || !timer->is_canceled() || timer->period() != std::chrono::hours(1)) {
    return false;
  }
  return std::any_of(callbacks_.begin(), callbacks_.end(), [&](const auto* other) {
    return other->entity->kind() == EntityKind::client &&
           other->entity->group() == entity.group() &&
           entity.name() == flat_name_of(other->entity->name()) + "_timeout";
  });
}

// Not periodic: alarms, time-outs and expiries of the library, timers whose releases a component
// sets, and timers in simulated time, which may run at any speed.
bool ModelBuilder::is_periodic(std::size_t callback) const {
  const Entity& entity = *callbacks_[callback]->entity;
  const auto* timer = dynamic_cast<const Timer*>(&entity);
  const auto* sets = dynamic_cast<const SetsReleases*>(callbacks_[callback]->node.get());
  if (timer == nullptr || sets != nullptr) return false;
  const auto simulated = timer->clock().as_simulated();
  if (simulated != nullptr && simulated->simulates()) return false;
  const bool is_alarm = entity.name().find('/') != std::string::npos;  // no user's name has one
  return !is_alarm && !is_timeout(entity) && !is_expiry(entity, *callbacks_[callback]->node);
}

// The speeds of the slowest and the fastest CPU that the executor's threads may use.
std::pair<double, double> ModelParts::speeds_of(std::size_t executor) const {
  const auto& speeds = description_.machine.speed;
  std::vector<double> found;
  for (const ModelledThread& thread : threads_) {
    if (thread.executor != executor) continue;
    for (const int cpu : thread.attributes.affinity.empty() ? cpus() : thread.attributes.affinity) {
      const auto speed = speeds.find(cpu);
      found.push_back(speed != speeds.end() ? speed->second : 1);
    }
  }
  if (found.empty()) return {1, 1};
  const auto [least, most] = std::minmax_element(found.begin(), found.end());
  return {*least, *most};
}

void ModelBuilder::set_execution(std::size_t index) {
  const ModelledProcess::Callback& callback = *callbacks_[index];
  analysis::Callback& described = model_.system.callbacks[index];
  SystemModel::Callback& facts = model_.callbacks[index];
  const auto budget = callback.parameters().budget;
  const std::optional<Nanoseconds> said = said_by_component(index);
  const Nanoseconds taken = taking(index);
  const Nanoseconds exact = said ? *said + sending(index) + taken : Nanoseconds::zero();
  const MeasuredCallback* const seen = measured(index);
  const auto [slowest, fastest] = speeds_of(described.executor);
  // The speed of the CPU of the run is not known: a measured time counts as of the slowest, a lower
  // bound.
  const Nanoseconds seen_by_clock = seen != nullptr ? seen->longest_execution : Nanoseconds{0};
  const Nanoseconds shown = work_in(seen_by_clock, slowest);
  const Nanoseconds known_by_clock = std::max(Nanoseconds(by_clock(exact, slowest)), seen_by_clock);
  Nanoseconds least{0}, longest{0};
  if (callback.described.execution) {
    facts.execution = Provenance::declared;
    longest = std::max(callback.described.execution->longest, shown);
    least = callback.described.execution->least;
    compare_execution(said.value_or(Nanoseconds::zero()), shown, index);
  } else if (budget && *budget >= known_by_clock) {
    facts.execution = Provenance::promised;
    longest = *budget;
  } else if (seen != nullptr && seen->longest_execution != Nanoseconds::zero()) {
    facts.execution = Provenance::measured;
    facts.measured_executions = seen->executions;
    longest = std::chrono::ceil<Nanoseconds>(
        std::chrono::duration<double, std::nano>(seen->longest_execution) *
        (1 + measured_->margin));
    longest = std::max(longest, exact);
  } else if (said) {
    facts.execution = Provenance::exact;
    longest = exact;
    if (says_all(index)) least = *said;  // a callback of another class may send before its end
  }
  if (!callback.described.publishes_at_end) least = Nanoseconds::zero();
  const double scale = execution_scale(description_, *callback.node, described.name);
  if (scale != 1 && facts.execution == Provenance::exact) facts.execution = Provenance::declared;
  // Whole nanoseconds at speed 1, like the work in a simulation.
  const Nanoseconds scaled(whole_time(scale * static_cast<double>(longest.count())));
  const double least_work = std::floor(scale * static_cast<double>(least.count()));
  const bool is_work = facts.execution != Provenance::promised;
  described.execution =
      std::max<analysis::Time>(1, is_work ? by_clock(scaled, slowest) : scaled.count());
  described.least_execution =
      std::min(described.execution, whole_time(std::floor(least_work / fastest)));
  const Nanoseconds shortest(described.least_execution);
  if (budget && *budget < std::max(known_by_clock, shortest)) {
    const bool is_declared = shortest > known_by_clock;
    refute_budget(index, std::max(known_by_clock, shortest),
                  is_declared                       ? declared_at(callback.described.where)
                  : seen_by_clock == known_by_clock ? measured_source()
                                                    : "its component");
  }
  if (facts.execution != Provenance::unknown) add_waits(index);
}

void ModelBuilder::refute_budget(std::size_t index, Nanoseconds known, std::string source) {
  const analysis::Callback& callback = model_.system.callbacks[index];
  const Nanoseconds budget = *callbacks_[index]->parameters().budget;
  assume({.id = "budgets_hold",
          .state = Assumption::State::refuted,
          .text = fmt::format("the budget of {{}}, {}, is less than its execution time, {}, which "
                              "counts",
                              to_string(budget), to_string(known)),
          .name = "'" + callback.name + "'",
          .source = std::move(source),
          .executor = callback.executor});
}

// A declared time below that of the component is an error; a measured time above it refutes it.
void ModelBuilder::compare_execution(Nanoseconds said, Nanoseconds seen, std::size_t index) {
  const CallbackDescription& described = callbacks_[index]->described;
  const analysis::Callback& callback = model_.system.callbacks[index];
  const Nanoseconds declared = described.execution->longest;
  if (declared < said) {
    throw Error(fmt::format("'{}' has an execution of {}, but its component says {}", callback.name,
                            to_string(declared), to_string(said)),
                "write the longer one, or leave it out", described.where);
  }
  if (declared >= seen) return;
  assume({.id = "as_declared",
          .state = Assumption::State::refuted,
          .text = fmt::format("{{}} took {} in the measured run, and its `execution` is {}",
                              to_string(seen), to_string(declared)),
          .name = "'" + callback.name + "'",
          .source = declared_at(described.where),
          .executor = callback.executor});
}

// The thread runs nothing else while the callback blocks. To count suspension as execution is safe,
// also for less urgent threads of the CPU (Chen et al.: "Many suspensions, many problems",
// Real-Time Systems 2019); but not for a reservation, which forfeits its budget while it waits.
void ModelBuilder::add_waits(std::size_t index) {
  const CallbackDescription& stated = callbacks_[index]->described;
  const MeasuredCallback* const seen = measured(index);
  analysis::Callback& callback = model_.system.callbacks[index];
  analysis::Executor& executor = model_.system.executors[callback.executor];
  const Nanoseconds observed =
      seen != nullptr ? seen->longest_wait.value_or(Nanoseconds::zero()) : Nanoseconds::zero();
  const Nanoseconds declared = stated.waits.value_or(Nanoseconds::zero());
  const Nanoseconds waits = std::max(observed, declared);
  if (waits == Nanoseconds::zero()) return;
  if (!stated.waits && observed > kShortWait && executor.unknown.empty()) {
    executor.unknown = fmt::format(
        "'{}' waited for {:.3f} ms in a measured execution, for a lock, a device, a reply or the "
        "like; "
        "state how long it may (`waits`)",
        callback.name, static_cast<double>(observed.count()) / 1e6);
  }
  if (executor.reservation && waits > kShortWait && executor.unknown.empty()) {
    executor.unknown = fmt::format(
        "'{}' waits, and its thread is SCHED_DEADLINE: no supply is known for one that waits",
        callback.name);
  }
  if (stated.waits && observed > declared) {
    assume({.id = "as_declared",
            .state = Assumption::State::refuted,
            .text = fmt::format("{{}} waited for {} in the measured run, and its `waits` is {}",
                                to_string(observed), to_string(declared)),
            .name = "'" + callback.name + "'",
            .source = declared_at(stated.where),
            .executor = callback.executor});
  }
  callback.execution += waits.count();
  model_.callbacks[index].waits = waits;
}

// ---- Orders ----

void ModelBuilder::set_order(const ModelledPart& part) {
  std::vector<CallbackInfo> infos;
  std::map<const CallbackGroup*, GroupId> groups;
  analysis::Executor& executor =
      model_.system.executors[static_cast<std::size_t>(&part - parts_.data())];
  const auto& listed = part.description->order;
  for (const std::size_t index : part.callbacks) {
    const ModelledProcess::Callback& callback = *callbacks_[index];
    const auto parameters = callback.parameters();
    if (parameters.overrun == OverrunPolicy::demote) executor.order = analysis::Order::arbitrary;
    const std::string name = model_.system.callbacks[index].name.substr(1);
    const auto place = std::find_if(listed.begin(), listed.end(), [&](const std::string& entry) {
      return entry == name || entry == "/" + name;
    });
    const auto group =
        groups.try_emplace(callback.entity->group().get(), static_cast<GroupId>(groups.size()));
    CallbackInfo& info = infos.emplace_back(
        callback_info(*callback.node, *callback.entity,
                      {.id = static_cast<CallbackId>(infos.size()),
                       .registration = static_cast<std::uint32_t>(place - listed.begin()),
                       .group = group.first->second}));
    if (callback.changed) {
      info.priority = parameters.priority.value_or(0);
      info.deadline = parameters.deadline.value_or(Nanoseconds::zero());
      info.budget = parameters.budget.value_or(Nanoseconds::zero());
      info.criticality = parameters.criticality.value_or(info.criticality);
      const bool is_timer = callback.entity->period() != Nanoseconds::zero();
      if (!is_timer) info.period = parameters.period.value_or(Nanoseconds::zero());
    }
    if (parameters.serving.value_or(Serving::usual) != Serving::usual) info = demoted(info);
  }
  const SchedulerTraits traits = schedulers().traits(part.scheduler);
  const std::vector<std::size_t> ranks =
      ranks_of(infos, part.scheduler, own_values_of(part.scheduler, description_));
  for (std::size_t i = 0; i < infos.size(); ++i) {
    analysis::Callback& callback = model_.system.callbacks[part.callbacks[i]];
    callback.group = infos[i].group;
    callback.place = ranks[i];
    callback.urgency = -static_cast<std::int64_t>(ranks[i]);
    const auto point = traits.point != nullptr ? traits.point(infos[i]) : std::nullopt;
    callback.point = point ? point->count() : kUnbounded;
    // A point in time counts from the sending of a message, and a bound from its arrival.
    const bool is_late = point && model_.callbacks[part.callbacks[i]].longest_way.count() != 0;
    if (!is_late || executor.order != analysis::Order::by_point) continue;
    executor.order = analysis::Order::arbitrary;
    if (executor.levels == 0 || !executor.unknown.empty()) continue;
    executor.unknown = fmt::format(
        "'{}' orders by a point in time that counts from when a message was sent, and those of "
        "'{}' are on their way for a time (`delay`)",
        part.scheduler, callback.name);
  }
}

// A thread waits for all rivals on its CPU, so a rival without a known demand makes its bound
// unknown.
void ModelBuilder::pass_on_what_is_unknown() {
  auto& executors = model_.system.executors;
  std::vector<std::string> causes;  // by executor; not those that only inherit an unknown
  for (const analysis::Executor& executor : executors) {
    causes.push_back(executor.spin >= kUnbounded && executor.unknown.empty()
                         ? fmt::format("'{}' spins always", executor.name)
                         : executor.unknown);
  }
  for (bool has_changed = true; std::exchange(has_changed, false);) {
    for (std::size_t i = 0; i < executors.size(); ++i) {
      if (!executors[i].unknown.empty()) continue;
      for (const std::size_t other : analysis::rivals(model_.system, i)) {
        if (causes[other].empty()) continue;
        executors[i].unknown =
            fmt::format("'{}' runs before it on CPU {}, and {}", executors[other].name,
                        fmt::join(executors[i].share->cpus, ", "), causes[other]);
        causes[i] = causes[other];
        has_changed = true;
        break;
      }
    }
  }
}

std::string_view to_string(Provenance provenance) noexcept {
  switch (provenance) {
    case Provenance::declared:
      return "declared";
    case Provenance::promised:
      return "promised";
    case Provenance::exact:
      return "exact";
    case Provenance::measured:
      return "measured";
    case Provenance::unknown:
      break;
  }
  return "unknown";
}

SystemModel make_system_model(const SystemDescription& description,
                              std::span<const PlannedChain> chains,
                              std::span<const ModelledProcess> processes,
                              const MeasuredModel* measured, const MachineFacts& machine) {
  return ModelBuilder(description, chains, processes, measured, machine).build();
}

}  // namespace takt
