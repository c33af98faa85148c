// The executors of a model, and their threads.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <thread>

#include <fmt/format.h>

#include "takt/containers/configuration/reservations.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/entities/file_descriptor.hpp"
#include "takt/entities/guard_condition.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/executors/pool_search.hpp"

namespace takt {
namespace {

// Only Takt's own type: in a library's, a band may have another policy.
bool is_preemptive(const std::string& type) {
  return type == "preemptive";
}

// Of a machine that nobody knows: 100 Hz, the slowest that Linux is built with.
constexpr Nanoseconds kLongestTick = std::chrono::milliseconds(10);

std::optional<Nanoseconds> some(Nanoseconds time) {
  return time != Nanoseconds::zero() ? std::optional(time) : std::nullopt;
}

std::optional<Nanoseconds> least_of(std::initializer_list<std::optional<Nanoseconds>> times) {
  std::optional<Nanoseconds> least;
  for (const auto& time : times) {
    if (time) least = std::min(*time, least.value_or(*time));
  }
  return least;
}

// A timer also overruns if it still runs at its next release.
std::optional<Nanoseconds> handled_after(const CallbackParameters& parameters, Nanoseconds period) {
  const bool sees_overruns = is_of_user(parameters.on_overrun);
  return least_of({is_of_user(parameters.on_deadline_miss) ? parameters.deadline : std::nullopt,
                   sees_overruns ? parameters.budget : std::nullopt,
                   sees_overruns ? some(period) : std::nullopt});
}

}  // namespace

bool is_wake_measured(const MachineDescription& machine, const MeasuredModel* measured) {
  return !machine.wake && measured != nullptr &&
         measured->wake_overhead.longest != Nanoseconds::zero();
}

analysis::Overheads overheads_of(const MachineDescription& machine, const MeasuredModel* measured) {
  double slowest = 1;
  for (const auto& [cpu, speed] : machine.speed) slowest = std::min(slowest, speed);
  const auto change = static_cast<double>(machine.change.value_or(Nanoseconds::zero()).count());
  analysis::Overheads overheads{.context_switch =
                                    static_cast<analysis::Time>(std::ceil(change / slowest))};
  const MeasuredModel none;
  const MeasuredModel& seen = measured != nullptr ? *measured : none;
  overheads.dispatch = machine.dispatch.value_or(seen.dispatch_overhead.longest).count();
  overheads.wake =
      is_wake_measured(machine, measured)
          ? seen.wake_overhead.longest.count()  // with the change to the thread
          : machine.wake.value_or(Nanoseconds::zero()).count() + overheads.context_switch;
  return overheads;
}

namespace {

MeasuredTimes scaled(const MeasuredCallback& seen, double scale) {
  const auto times = [&](Nanoseconds time) {
    return std::chrono::round<Nanoseconds>(std::chrono::duration<double, std::nano>(time) * scale);
  };
  return {.least = times(seen.least_execution),
          .median = times(seen.median_execution),
          .p99 = times(seen.p99_execution),
          .longest = times(seen.longest_execution)};
}

}  // namespace

void ModelBuilder::add_callbacks() {
  for (const ModelledProcess& process : processes_) {
    for (const ModelledProcess::Callback& callback : process.callbacks) {
      const std::size_t index = callbacks_.size();
      const std::size_t part = part_of(process, callback);
      parts_[part].callbacks.push_back(index);
      callbacks_.push_back(&callback);
      analysis::Callback& described = model_.system.callbacks.emplace_back();
      described.name = to_string(Chain::Step{callback.node, callback.entity->name()});
      described.executor = part;
      SystemModel::Callback& facts = model_.callbacks.emplace_back();
      if (const auto* end = dynamic_cast<const SubscriptionBase*>(callback.entity.get())) {
        facts.depth = end->qos().depth;
      }
      if (const MeasuredCallback* const seen = measured(index)) {
        facts.dropped = seen->dropped;
        facts.seen = scaled(*seen, execution_scale(description_, *callback.node, described.name));
      }
      if (facts.depth != 0) described.depth = static_cast<analysis::Count>(facts.depth);
      if (facts.dropped != 0) described.depth = 0;
      const CallbackParameters parameters = callback.parameters();
      const Nanoseconds period = callback.entity->period();
      if (parameters.overrun == OverrunPolicy::abort) {
        facts.given_up_after = least_of({parameters.budget, parameters.deadline, some(period)});
      }
      facts.merges = dynamic_cast<const GuardCondition*>(callback.entity.get()) != nullptr ||
                     dynamic_cast<const FileDescriptor*>(callback.entity.get()) != nullptr;
      facts.skips = parameters.overrun == OverrunPolicy::skip;
      facts.handled_after = handled_after(parameters, period);
    }
  }
  check_names();
}

// What a run shows of a name is of one node: its subscriptions of one topic are together no less
// than each.
void ModelBuilder::check_names() const {
  std::map<std::string_view, const Node*> known;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const analysis::Callback& callback = model_.system.callbacks[i];
    const Node* const node = callbacks_[i]->node.get();
    if (known.emplace(callback.name, node).first->second == node) continue;
    if (!measured_callbacks_.contains(callback.name)) continue;
    throw Error(
        fmt::format("'{}' is a callback of two nodes, and the model does not tell them apart",
                    callback.name),
        "rename a node or a topic, and measure again", measured_->path);
  }
}

std::size_t ModelBuilder::part_of(const ModelledProcess& process,
                                  const ModelledProcess::Callback& callback) {
  const auto description =
      std::find_if(process.executors.begin(), process.executors.end(),
                   [&](const auto& executor) { return executor.name == callback.executor; });
  if (description == process.executors.end()) {
    throw Error(fmt::format("'{}' runs on '{}', which is not an executor of '{}'",
                            callback.entity->name(), callback.executor, process.name));
  }
  const ExecutorTraits traits = executors().traits(description->type);
  const void* child = nullptr;
  if (traits.isolates) {
    child = description->per == Isolation::node ? static_cast<const void*>(callback.node.get())
                                                : callback.entity->group().get();
  }
  const auto [found, is_new] =
      part_index_.try_emplace({&process, description->name, child}, parts_.size());
  if (!is_new) return found->second;
  const std::string scheduler =
      description->scheduler.empty() ? traits.scheduler : description->scheduler;
  model_.executors_at.push_back(description->where);
  analysis::Executor& executor = model_.system.executors.emplace_back();
  executor.name =
      processes_.size() > 1 ? process.name + "/" + description->name : description->name;
  if (traits.isolates) executor.name += callback.node->fully_qualified_name();
  if (traits.isolates && description->per == Isolation::group) {
    executor.name += "/" + callback.entity->group()->name();
  }
  executor.order = schedulers().traits(scheduler).order;
  executor.is_wait_set = traits.readiness == Readiness::wait_set;
  const TriggerOptions& trigger = description->trigger;
  executor.let_period = trigger.let_period.count();
  if (trigger.kind != TriggerOptions::Kind::any) {
    executor.unknown = "its trigger may wait for ever; there are bounds for `any` only";
  } else if (traits.rule != nullptr && !traits.triggered) {
    executor.unknown = fmt::format("no method knows the rule of type '{}'", description->type);
  } else if (traits.workers != nullptr && !is_preemptive(description->type)) {
    executor.unknown =
        fmt::format("no method knows the workers' policy of type '{}'", description->type);
  }
  parts_.push_back({&process, &*description, scheduler, {}});
  add_threads(process, *description, callback, traits);
  return found->second;
}

void ModelBuilder::add_threads(const ModelledProcess& process,
                               const ExecutorDescription& description,
                               const ModelledProcess::Callback& callback,
                               const ExecutorTraits& traits) {
  const std::size_t part = parts_.size() - 1;
  std::vector<ThreadAttributes> own;
  for (const std::string& name : description.threads) {
    const auto found = std::find_if(process.threads.begin(), process.threads.end(),
                                    [&](const auto& thread) { return thread.name == name; });
    own.push_back(found != process.threads.end() ? *found : ThreadAttributes{.name = name});
  }
  if (own.empty()) {
    const std::size_t count =
        traits.pool ? std::max<std::size_t>(2, std::thread::hardware_concurrency()) : 1;
    own.assign(count, {.name = description.name});
  }
  if (processes_.size() > 1) {
    for (ThreadAttributes& thread : own) thread.name = process.name + "/" + thread.name;
  }
  const auto set_count = [&](std::size_t count) {
    analysis::Executor& executor = model_.system.executors[part];
    executor.threads = count;
    if (count > 1 && limits_chains(description_) && executor.unknown.empty())
      executor.unknown = "no method knows the `concurrency` of a chain";
  };
  if (!traits.isolates) {
    own.resize(std::min(own.size(), traits.max_threads));
    int highest = 0;
    if (is_preemptive(description.type)) {  // a thread above one of its priorities is above all
      model_.system.executors[part].levels = own.size();
      if (own.size() > 1) highest = own.back().priority;
      own.resize(1);
    }
    for (const ThreadAttributes& thread : own) threads_.push_back({part, thread, highest});
    return set_count(own.size());
  }
  // The executor knows the thread: nodes without callbacks have threads, too, and some nodes have
  // gone.
  const auto& [place, attributes] = callback.thread.value();
  ThreadAttributes thread = own[place % own.size()];
  if (description.per == Isolation::group) {  // the group's parameters when its thread was made
    thread.priority = attributes.priority;
    thread.runtime = attributes.runtime;
    thread.deadline = attributes.deadline;
    thread.period = attributes.period;
  }
  const bool is_shared = description.per == Isolation::group &&
                         callback.entity->group()->type() == CallbackGroupType::Reentrant;
  const auto count = static_cast<std::size_t>(is_shared ? description.reentrant_threads : 1);
  threads_.insert(threads_.end(), count, {part, thread});
  set_count(count);
}

void ModelBuilder::place_threads() {
  std::vector<ThreadAttributes> wanted = reserved_threads(description_, processes_.size());
  for (const ModelledThread& thread : threads_) wanted.push_back(thread.attributes);
  check_reservations(wanted, description_.machine, description_.file);
  const bool has_rights = description_.realtime != Realtime::off;
  for (ModelledThread& thread : threads_) {
    ThreadAttributes& attributes = thread.attributes;
    if (!has_rights) {
      attributes = {.name = attributes.name, .affinity = attributes.affinity};
    }
    model_.system.executors[thread.executor].is_realtime |=
        attributes.policy == ThreadPolicy::fifo || attributes.policy == ThreadPolicy::rr;
  }
  places_ = find_places(threads_, parts_.size(), cpus(), description_.machine.is_exclusive);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    analysis::Executor& executor = model_.system.executors[i];
    executor.reservation = places_[i].reservation;
    executor.share = places_[i].share;
    executor.movers = places_[i].movers;
    if (executor.unknown.empty()) executor.unknown = places_[i].unknown;
    if (!has_rights && !places_[i].unknown.empty()) {
      executor.unknown = "with `realtime: off`, " + executor.unknown;
    }
    const ExecutorDescription& description = *parts_[i].description;
    executor.early_wake = description.early_wake.count();
    executor.spin =
        description.spin == kSpinAlways ? analysis::kUnbounded : description.spin.count();
    // One of a pool also searches while others work, and then for kPoolSearch; with `spin`, anew
    // from each message, and from each begin and end of an execution.
    if (executor.threads > 1)
      executor.spin = analysis::plus(analysis::times(3, executor.spin), kPoolSearch.count());
    const auto dispatch = static_cast<double>(model_.system.overheads.dispatch);
    const double longer = dispatch / speeds_of(i).first - dispatch;
    executor.more_dispatch = std::max<analysis::Time>(0, whole_time(longer));
  }
  if (const RealtimeGrant grant = granted(); grant.is_limited()) {
    // The kernel checks only once a tick whether the budget is used up, or others have had theirs.
    const Nanoseconds less = grant.runtime - machine_.tick.value_or(kLongestTick);
    model_.system.for_realtime = {.budget = std::max<analysis::Time>(1, less.count()),
                                  .period = grant.period.count()};
    model_.system.may_come_twice = may_have_fair_server();
  }
}

}  // namespace takt
