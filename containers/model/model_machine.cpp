// The assumptions about the machine: what else runs there, and overheads.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/cpu_model.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/model/model_builder.hpp"

namespace takt {

namespace {

using State = Assumption::State;
using analysis::plus;
using analysis::times;

// Limit: bytes of a message that count as nothing where the file states no time for them. At it:
// their time is assumed to be zero. Seen: the assumption.
constexpr std::size_t kFewBytes = 4096;

/// The time to write or read the bytes.
analysis::Time copying(const MachineDescription& machine, std::size_t bytes) {
  const double megabytes = static_cast<double>(bytes) / 1e6;
  const Nanoseconds each = machine.publish_megabyte.value_or(Nanoseconds::zero());
  return whole_time(megabytes * static_cast<double>(each.count()));
}

// By executor. To wake up is to be changed to, which a `wake` that is measured has in it: it pays
// for more than that if its bounds say so.
std::vector<bool> pay_changes(const SystemModel& model, bool has_wake_changes) {
  const std::vector<bool> all(model.system.executors.size(), true);
  if (!has_wake_changes) return all;
  try {
    return analysis::pays(model.system, &analysis::Overheads::context_switch,
                          {.methods = {}, .limit = longest_bound(model)});
  } catch (const analysis::TooManyPaths&) {
    return all;  // there will be no bound
  }
}

}  // namespace

MachineFacts facts_of_kernel() {
  MachineFacts facts;
  facts.grant = realtime_grant();
  facts.fair_server = fair_server();
  facts.tick = scheduler_tick();
  facts.turn_of_round_robin = turn_of_round_robin();
  return facts;
}

void AssumptionFinder::add_assumptions_of_machine() {
  const auto& executors = model_.system.executors;
  add_cpus();
  for (std::size_t i = 0; i < executors.size(); ++i) {
    add_what_else_runs(i);
    const auto [slowest, fastest] = speeds_of(i);
    if (slowest == 1 && fastest == 1) continue;
    assume({.id = "times_scale_with_speed",
            .state = State::unchecked,
            .text = "execution times of {} are those of a CPU of speed 1, divided by `speed`",
            .name = "'" + executors[i].name + "'",
            .source = declared_at(line_of("a machine", "speed")),
            .executor = i});
  }
  if (machine_.is_virtual.value_or(true)) {
    assume({.id = "host_not_shared",
            .state = if_watched(),
            .text = machine_.is_virtual
                        ? "this machine is virtual: its host takes no CPU away"
                        : "the machine is not virtual, or its host takes no CPU away",
            .name = {},
            .source = "nobody",
            .executor = {}});
  }
  // Unless the file requires locked memory, a run without it continues.
  if (!description_.lock_memory || description_.realtime != Realtime::require) {
    assume({.id = "no_page_faults",
            .state = if_watched(),
            .text = description_.lock_memory && description_.realtime == Realtime::prefer
                        ? "no callback waits for a page of memory: Linux may refuse to lock it, "
                          "without `realtime: require`"
                        : "no callback waits for a page of memory: nothing is locked",
            .name = {},
            .source = "nobody",
            .executor = {}});
  }
  add_throttling();
}

void AssumptionFinder::add_throttling() {
  const auto& stated = description_.machine.rt_runtime;
  if (!stated && !model_.system.for_realtime) return;
  const auto& here = machine_.grant;
  const RealtimeGrant wanted = granted();
  if (stated && (!here || here->share() < wanted.share() ||
                 here->period - here->runtime > wanted.period - wanted.runtime)) {
    assume({.id = "rt_runtime_as_here",
            .state = State::unchecked,
            .text = here ? fmt::format("Linux grants as much to real-time threads as `rt_runtime` "
                                       "says, though here it is {}",
                                       to_string(*here))
                         : "Linux grants as much to real-time threads as `rt_runtime` says",
            .name = {},
            .source = declared_at(line_of("a machine", "rt_runtime")),
            .executor = {}});
  }
  if (!stated) {
    assume({.id = "rt_runtime_as_here",
            .state = here ? State::checked : State::unchecked,
            .text = fmt::format("Linux grants {} to the real-time threads of a CPU, as on this "
                                "machine",
                                to_string(wanted)),
            .name = {},
            .source = "this machine",
            .executor = {}});
  }
}

// Threads without an affinity use all of `machine: cpus`.
void AssumptionFinder::add_cpus() {
  const std::set<int> stated(description_.machine.cpus.begin(), description_.machine.cpus.end());
  const std::set<int> here(available_cpus().begin(), available_cpus().end());
  if (stated.empty() || stated == here) return;
  for (const ModelledThread& thread : threads_) {
    if (!thread.attributes.affinity.empty()) continue;
    assume({.id = "as_declared",
            .state = State::unchecked,
            .text = fmt::format("the threads of {{}} may use the CPUs {}, though here the process "
                                "may use {}",
                                fmt::join(stated, ", "), fmt::join(here, ", ")),
            .name = "'" + model_.system.executors[thread.executor].name + "'",
            .source = declared_at(line_of("a machine", "cpus")),
            .executor = thread.executor});
  }
}

// Tests of a scheduler see only some of its choices, so its traits may be wrong.
void AssumptionFinder::add_orders() {
  constexpr std::array kOfTakt{"chain_edf",    "chain_priority", "edf",    "fifo", "fixed_priority",
                               "job_priority", "least_laxity",   "listed", "ros",  "round_robin"};
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const std::string& name = parts_[i].scheduler;
    if (std::find(kOfTakt.begin(), kOfTakt.end(), name) != kOfTakt.end()) continue;
    const bool has_any_order = model_.system.executors[i].order == analysis::Order::arbitrary;
    assume({.id = "as_declared",
            .state = State::unchecked,
            .text = fmt::format("scheduler '{}' always {}", name,
                                has_any_order ? "has a callback to run while one waits"
                                              : "orders as its traits say"),
            .name = {},
            .source = "its library",
            .executor = i});
  }
}

// Whether other threads may run before those of an executor.
void AssumptionFinder::add_what_else_runs(std::size_t index) {
  const analysis::Executor& executor = model_.system.executors[index];
  const std::string name = "'" + executor.name + "'";
  const auto add = [&](const char* id, State state, const char* text, std::string source) {
    assume({.id = id,
            .state = state,
            .text = text,
            .name = name,
            .source = std::move(source),
            .executor = index});
  };
  const bool is_promised = description_.machine.is_exclusive;
  const std::string promise =
      is_promised ? declared_at(line_of("a machine", "exclusive")) : "nobody";
  if (!executor.is_realtime && !executor.reservation) {
    add("nothing_else_runs", State::unchecked,
        "nothing else runs on the CPUs of {}, no control group limits them, and nobody stops them "
        "(SIGSTOP, a debugger)",
        promise);
    add("dds_threads_elsewhere", State::unchecked,
        "Takt's own threads and those of DDS need no time on the CPUs of {}", "nobody");
    return;
  }
  // Unless the file requires real-time privileges, a run without them continues.
  add("realtime_granted",
      description_.realtime == Realtime::require ? State::checked : if_watched(),
      "Linux gives the threads of {} their policies and priorities", "nobody");
  if (may_have_fair_server()) {
    // A watch cannot distinguish a turn of the fair server from the end of a budget.
    add("rt_runtime_as_here", executor.reservation ? State::unchecked : if_watched(),
        executor.reservation
            ? "the fair server, which newer kernels have, runs no other threads before those of {}"
            : "the fair server, which newer kernels have, runs other threads before those of {} "
              "only when these have used what `rt_runtime` grants",
        "this machine");
  }
  if (executor.share && executor.share->slice != 0) {
    const auto& turn = machine_.turn_of_round_robin;
    add("rt_runtime_as_here",
        !turn                     ? State::unchecked
        : *turn < CpuModel::kTurn ? State::refuted
                                  : State::checked,
        "turns of SCHED_RR take 100 ms (`sched_rr_timeslice_ms`), or more, for {}", "this machine");
  }
  add_reservations(index);
  add_threads_of_others(index);
  add("nothing_else_runs", if_watched(),
      joins_dds()
          ? "no other thread, nor one of DDS to which `CYCLONEDDS_URI` gives a priority, runs "
            "before those of {} on their CPUs, and nobody stops them (SIGSTOP, a debugger)"
          : "no other thread runs before those of {} on their CPUs, and nobody stops them "
            "(SIGSTOP, a debugger)",
      promise);
}

// Linux schedules all reservations together. One that ends late delays the others and all less
// urgent threads, and has less budget in its own next period.
void AssumptionFinder::add_reservations(std::size_t index) {
  const auto& executors = model_.system.executors;
  const std::vector<std::size_t> before = analysis::rivals(model_.system, index);
  for (std::size_t other = 0; other < executors.size(); ++other) {
    const bool is_before = std::find(before.begin(), before.end(), other) != before.end();
    if (!executors[other].reservation || !(executors[index].reservation || is_before)) continue;
    assume({.id = "reservations_end",
            .state = State::unchecked,
            .text = "the kernel ends each budget of {} when it is used up, not at the next tick",
            .name = "'" + executors[other].name + "'",
            .source = "nobody",
            .executor = index});
  }
}

// Threads of other processes at the time of the analysis: further ones may come at any time.
void AssumptionFinder::add_threads_of_others(std::size_t index) {
  for (const ModelledThread& thread : threads_) {
    if (thread.executor != index) continue;
    const ThreadAttributes& own = thread.attributes;
    for (const MachineFacts::Thread& other : machine_.others) {
      const std::vector<int>& its = own.affinity.empty() ? cpus() : own.affinity;
      const bool may_meet = std::find_first_of(its.begin(), its.end(), other.cpus.begin(),
                                               other.cpus.end()) != its.end();
      const bool is_before = other.is_reserved || (own.policy != ThreadPolicy::deadline &&
                                                   other.priority >= own.priority);
      // A less urgent thread uses up some of the budget that Linux grants to all real-time threads.
      if (!may_meet || !(is_before || model_.system.for_realtime)) continue;
      const std::string of = other.process == 0 ? std::string("of a component")
                                                : fmt::format("of process {}", other.process);
      assume({.id = "nothing_else_runs",
              .state = if_watched(),
              .text = fmt::format("the real-time thread '{}' {} is not there beside those of {{}}, "
                                  "or short",
                                  other.name, of),
              .name = "'" + model_.system.executors[index].name + "'",
              .source = "this machine",
              .executor = index});
    }
  }
}

// Whether the callback sends messages at a cost that its component's execution time leaves out.
bool AssumptionFinder::sends(std::size_t index) const {
  if (model_.callbacks[index].execution != Provenance::exact) return false;
  const auto sent = said_to_send(index);
  return sent ? sent->messages != 0 : !model_.system.callbacks[index].outputs.empty();
}

std::optional<Nanoseconds> ModelParts::said_by_component(std::size_t index) const {
  const ModelledProcess::Callback& callback = *callbacks_[index];
  const auto* component = dynamic_cast<const KnowsExecutionTimes*>(callback.node.get());
  return component != nullptr ? component->execution_time(callback.entity->name()) : std::nullopt;
}

std::optional<Sending> ModelParts::said_to_send(std::size_t index) const {
  const ModelledProcess::Callback& callback = *callbacks_[index];
  const auto* component = dynamic_cast<const KnowsExecutionTimes*>(callback.node.get());
  return component != nullptr ? component->sends(callback.entity->name()) : std::nullopt;
}

std::vector<std::size_t> ModelParts::senders_elsewhere(std::size_t callback) const {
  std::vector<std::size_t> result;
  for (const std::size_t from : topics_.senders(callback)) {
    if (process_of(from) != process_of(callback)) result.push_back(from);
  }
  return result;
}

// The time for sending, which the execution time of a component leaves out.
Nanoseconds ModelBuilder::sending(std::size_t index) {
  const MachineDescription& machine = description_.machine;
  const auto sent = said_to_send(index);
  analysis::Count& others = model_.callbacks[index].other_receivers;  // so far all receivers
  const auto messages = static_cast<analysis::Count>(sent ? sent->messages : 1);
  others = std::max<analysis::Count>(0, others - messages);
  if (!sent) return Nanoseconds::zero();
  std::set<const ModelledProcess*> elsewhere;  // each gets a copy
  for (const analysis::Output& output : model_.system.callbacks[index].outputs) {
    if (process_of(output.to) != process_of(index)) elsewhere.insert(process_of(output.to));
  }
  const auto copies = static_cast<analysis::Count>(std::max<std::size_t>(1, elsewhere.size()));
  const auto each = machine.publish.value_or(Nanoseconds::zero()).count();
  const auto other = machine.publish_receiver.value_or(Nanoseconds::zero()).count();
  const analysis::Time result =
      plus(times(each, messages),
           plus(times(other, others), times(copying(machine, sent->bytes), copies)));
  analysis::Executor& executor = model_.system.executors[model_.system.callbacks[index].executor];
  if (executor.let_period != 0) {
    const double slowest = speeds_of(model_.system.callbacks[index].executor).first;
    executor.sending = plus(executor.sending, whole_time(static_cast<double>(result) / slowest));
  }
  return Nanoseconds(plus(result, copying(machine, sent->written)));
}

// The cost of reading a message of another process, which equals the cost of writing it.
Nanoseconds ModelBuilder::taking(std::size_t index) {
  const MachineDescription& machine = description_.machine;
  const analysis::Time each = machine.publish.value_or(Nanoseconds::zero()).count();
  analysis::Time longest = comes_from_outside(index) ? each : 0;
  for (const std::size_t from : senders_elsewhere(index)) {
    const auto sent = said_to_send(from);
    longest = std::max(longest, plus(each, sent ? copying(machine, sent->bytes) : 0));
    if (sent) model_.callbacks[index].bytes = std::max(model_.callbacks[index].bytes, sent->bytes);
  }
  return Nanoseconds(longest);
}

double execution_scale(const SystemDescription& description, const Node& node,
                       const std::string& callback) {
  double scale = 1;
  for (const std::string& name : {node.fully_qualified_name(), callback}) {
    const auto found = description.execution_scales.find(name);
    if (found != description.execution_scales.end()) scale *= found->second;
  }
  return scale;
}

// `said` may be 0, too, and `measured` counts without it; 0: it is not known.
void AssumptionFinder::assume_overhead(const char* what, const std::optional<Nanoseconds>& said,
                                       Nanoseconds measured, std::optional<std::size_t> executor) {
  const bool is_known = said || measured != Nanoseconds::zero();
  const bool is_here = said && machine_.overhead_samples != 0;
  const char* const id = !is_known                          ? "overheads_are_zero"
                         : said && !is_here                 ? "as_declared"
                         : is_here && machine_.name.empty() ? "model_from_elsewhere"
                                                            : "as_measured";
  assume(
      {.id = id,
       .state = State::unchecked,
       .text = id == std::string_view("model_from_elsewhere")
                   ? "these take no longer there than here, though `machine: cpus` names another "
                     "machine: {}"
               : is_known ? "these take no longer than stated or measured: {}"
                          : "these take no time: {}",
       .name = what,
       .source = !is_known ? std::string("nobody")
                 : is_here ? fmt::format("measured here, n = {}", machine_.overhead_samples)
                 : said    ? declared_at(line_of("a machine", "overheads"))
                           : measured_source(),
       .executor = executor});
}

void AssumptionFinder::add_overheads() {
  const MachineDescription& stated = description_.machine;
  const MeasuredModel none;
  const MeasuredModel& seen = measured_ != nullptr ? *measured_ : none;
  const auto add = [&](const char* what, const std::optional<Nanoseconds>& said,
                       const MeasuredTimes& shown, analysis::Time counted) {
    assume_overhead(what, said, shown.longest, {});
    if (!said || shown.least.count() <= counted) return;
    assume({.id = "as_declared",
            .state = State::refuted,
            .text = "in the measured run these took longer than stated, each time: {}",
            .name = what,
            .source = declared_at(line_of("a machine", "overheads")),
            .executor = {}});
  };
  const analysis::Overheads& counted = model_.system.overheads;
  add("an executor's way to its next callback", stated.dispatch, seen.dispatch_overhead,
      counted.dispatch);
  add("waking a thread", stated.wake, seen.wake_overhead, counted.wake);
  const std::vector<bool> pay = pay_changes(model_, is_wake_measured(stated, measured_));
  for (std::size_t i = 0; i < pay.size(); ++i) {
    if (pay[i]) assume_overhead("a change from thread to thread", stated.change, {}, i);
  }
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    add_overheads_of_taking(i);
    add_overheads_of_sending(i);
  }
}

// Whether all messages of the callback are small and from its own process.
bool AssumptionFinder::gets_small_messages(std::size_t callback) const {
  if (callbacks_[callback]->entity->kind() == EntityKind::timer) return true;
  if (comes_from_outside(callback) || !senders_elsewhere(callback).empty()) return false;
  const auto& from = topics_.senders(callback);
  return std::all_of(from.begin(), from.end(), [this](std::size_t each) {
    const auto sent = said_to_send(each);
    return sent && sent->bytes <= kFewBytes;
  });
}

void AssumptionFinder::add_overheads_of_taking(std::size_t callback) {
  const auto senders = senders_elsewhere(callback);
  const std::size_t executor = model_.system.callbacks[callback].executor;
  const bool is_from_outside = comes_from_outside(callback);
  if (is_dropped(callback) && !gets_small_messages(callback))
    assume_overhead("taking and destroying what a mode drops", {}, {}, executor);
  if (is_dropped(callback) || (senders.empty() && !is_from_outside)) return;
  const MachineDescription& stated = description_.machine;
  const Provenance from = model_.callbacks[callback].execution;
  if (from == Provenance::declared) return;
  // Under logical execution time, messages are taken before the callback, so measured times exclude
  // it.
  if (from == Provenance::measured && model_.system.executors[executor].let_period == 0) return;
  const bool is_charged = from == Provenance::exact && machine_.overhead_samples == 0;
  assume_overhead("taking a message of another process", is_charged ? stated.publish : std::nullopt,
                  {}, executor);
  const bool are_known =
      !is_from_outside && std::all_of(senders.begin(), senders.end(), [&](auto sender) {
        const auto sent = said_to_send(sender);
        return sent && (sent->bytes <= kFewBytes || stated.publish_megabyte);
      });
  if (is_charged && stated.publish && !are_known) {
    assume_overhead("taking more than a small message", {}, {}, executor);
  }
}

void AssumptionFinder::add_overheads_of_sending(std::size_t callback) {
  const MachineDescription& stated = description_.machine;
  const std::size_t executor = model_.system.callbacks[callback].executor;
  const auto& outputs = model_.system.callbacks[callback].outputs;
  const bool sends_later = model_.system.executors[executor].let_period != 0 && !outputs.empty();
  if (sends_later && model_.callbacks[callback].execution != Provenance::exact) {
    assume_overhead("sending at the end of a period", {}, {}, executor);
  }
  if (!sends(callback)) return;
  assume_overhead("sending a message", stated.publish, {}, executor);
  if (stated.publish && model_.callbacks[callback].other_receivers != 0)
    assume_overhead("sending to a second subscription", stated.publish_receiver, {}, executor);
  // Measured overheads are of sending within a process.
  const bool leaves = std::any_of(outputs.begin(), outputs.end(), [&](const auto& output) {
    return process_of(output.to) != process_of(callback);
  });
  if (leaves && machine_.overhead_samples != 0) {
    assume_overhead("sending to another process", {}, {}, executor);
  }
  if (!stated.publish) return;
  const auto sent = said_to_send(callback);
  const bool is_charged = stated.publish_megabyte.has_value();
  if (!sent || (!is_charged && sent->bytes > kFewBytes)) {
    assume_overhead("sending more than a small message", {}, {}, executor);
  }
  if (sent && !is_charged && sent->written > kFewBytes) {
    assume_overhead("writing the bytes of a message", {}, {}, executor);
  }
}

}  // namespace takt
