// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/simulation.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/containers/configuration/reservations.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/simulation/arrivals.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/containers/simulation/fault_injection.hpp"
#include "takt/containers/simulation/first_releases.hpp"
#include "takt/containers/simulation/run_refusal.hpp"
#include "takt/containers/simulation/simulated_bodies.hpp"
#include "takt/containers/simulation/simulated_machine.hpp"
#include "takt/containers/simulation/simulated_processes.hpp"
#include "takt/containers/simulation/wire.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {
namespace {

[[noreturn]] void refuse(const SystemDescription& system, const std::string& what,
                         const std::string& instead, const SourceLine& where = {}) {
  throw Error(fmt::format("cannot simulate {}", what), instead,
              where.empty() ? system.file : where);
}

}  // namespace

// ---- What is simulated ----

Simulation::Simulation(SystemDescription system, SimulationOptions options)
    : system_(std::move(system)), options_(std::move(options)) {
  processes_ = split(system_, Composition::file);
  if (processes_.empty()) refuse(system_, "a file without components", "add some");
  if (processes_.size() == 1) system_ = processes_.front();
  std::erase_if(system_.executors, [&](const ExecutorDescription& executor) {
    return std::none_of(processes_.begin(), processes_.end(), [&](const auto& process) {
      const auto& used = process.executors;
      return std::any_of(used.begin(), used.end(),
                         [&](const auto& other) { return other.name == executor.name; });
    });
  });
  refuse_what_differs();
  take_machine();
  modelled_ = system_;  // as it is said: what is left out next may decide who sends to whom
  modelled_.machine.speed.clear();
  leave_out_surroundings();
  processes_ = split(system_, Composition::file);
  for (SystemDescription& process : processes_) {
    process.dds.reset();
    process.is_split_off = true;
  }
}

void Simulation::refuse_what_differs() {
  if (!system_.modes.empty() && options_.overrides.mode.empty()) {
    refuse(system_, "the modes of the file without `--mode`: a simulation does not switch",
           fmt::format("choose the one to simulate: --mode {}",
                       fmt::join(Modes(system_.modes).names(), ", ")),
           system_.modes.front().where);
  }
  for (const ExecutorDescription& executor : system_.executors) {
    const std::string& override = options_.overrides.executor;
    const std::string& type = override.empty() ? executor.type : override;
    const ExecutorTraits traits = executors().traits(type);
    if (!traits.simulated) {
      refuse(
          system_,
          fmt::format("executor '{}': type '{}' is a class of its own, which may sleep by itself",
                      executor.name, type),
          "choose another, or say `.simulated = true` where it is registered, if it is made of "
          "executors of the engine",
          executor.where);
    }
    const Nanoseconds period = executor.trigger.let_period;
    const Nanoseconds least = Nanoseconds(std::chrono::seconds(1)) / RunRefusal::kMostInASecond;
    if (!traits.triggered || period == Nanoseconds::zero() || period >= least) continue;
    refuse(system_,
           fmt::format("executor '{}': `let: {}` has more than {} periods in a second",
                       executor.name, to_string(period), RunRefusal::kMostInASecond),
           fmt::format("let it be at least {}", to_string(least)), executor.where);
  }
  for (ComponentDescription& component : system_.components) {
    // The thread that removes a node has no CPU of the simulated machine.
    if (component.on_exception == OnException::remove_node)
      component.on_exception = OnException::terminate;
    if (component.type == "takt::Recorder" || component.type == "takt::Player") {
      refuse(system_, fmt::format("{}, which has files and threads of its own", noun_of(component)),
             "leave it out", component.where);
    }
    const auto sim_time = component.parameters.find(kUseSimTime);
    if (sim_time == component.parameters.end() || sim_time->second != ParameterValue(true))
      continue;
    refuse(system_, fmt::format("{}, which follows /clock (`use_sim_time`)", noun_of(component)),
           "leave that out: the clock is simulated anyway", component.where);
  }
}

// Determines the CPUs, and the CPU time that Linux grants to real-time threads on them. The CPUs of
// this machine count only if the file names none.
void Simulation::take_machine() {
  const bool has_rights = system_.realtime != Realtime::off;
  if (!has_rights) notes_.emplace_back("`realtime: off`: all threads are SCHED_OTHER");
  std::set<int> named;
  bool are_named = !system_.executors.empty();
  for (ThreadDescription& thread : system_.threads) {
    ThreadAttributes& attributes = thread.attributes;
    if (!has_rights) attributes = {.name = attributes.name, .affinity = attributes.affinity};
    named.insert(attributes.affinity.begin(), attributes.affinity.end());
    are_named = are_named && !attributes.affinity.empty();
  }
  for (const ExecutorDescription& executor : system_.executors)
    are_named = are_named && !executor.threads.empty();
  if (!system_.machine.rt_runtime) system_.machine.rt_runtime = kUsualRtRuntime;
  std::vector<int>& cpus = system_.machine.cpus;
  if (cpus.empty()) {
    if (are_named) {
      cpus.assign(named.begin(), named.end());
    } else {
      cpus = available_cpus();
      has_cpus_of_here_ = true;
      notes_.push_back(
          fmt::format("simulated on the CPUs of this machine, {}; `machine: cpus` "
                      "says others",
                      fmt::join(cpus, ", ")));
    }
  }
  if (options_.speed != 1) {
    for (const int cpu : cpus)
      system_.machine.speed.try_emplace(cpu, 1).first->second *= options_.speed;
  }
  for (const ThreadDescription& thread : system_.threads) {
    for (const int cpu : thread.attributes.affinity) {
      if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end()) continue;
      refuse(system_,
             fmt::format("thread '{}' on CPU {}: the machine has the CPUs {}",
                         thread.attributes.name, cpu, fmt::join(cpus, ", ")),
             "correct its affinity, or `machine: cpus`", thread.where);
    }
  }
  check_reservations(described_threads(system_), system_.machine, system_.file);
}

void Simulation::leave_out_surroundings() {
  if (system_.lifecycle) {
    for (const auto& node : system_.lifecycle->bring_up) bring_up_.push_back(node.name);
    notes_.emplace_back("lifecycle nodes are active from the start, and stay so");
  }
  if (processes_.size() > 1)
    notes_.emplace_back("nothing comes from outside of these processes but by `arrival`");
  else if (system_.dds)
    notes_.emplace_back("nothing comes from other processes but by `arrival`");
  system_.lifecycle.reset();
  system_.dds.reset();
  system_.restarts.clear();
  system_.lock_memory = false;
  system_.cpu_dma_latency_us.reset();
  system_.watches_bounds = false;
  system_.must_match.clear();
  system_.realtime = Realtime::off;  // nothing is requested from this machine
  std::set<std::string> used;
  for (ExecutorDescription& executor : system_.executors) {
    used.insert(executor.threads.begin(), executor.threads.end());
    executor.wait = "auto";
  }
  // Takt's own threads stay in the list, because a band ends below their priorities, but under
  // other names, so that no container makes them.
  std::vector<std::string> left_out;
  for (ThreadDescription& thread : system_.threads) {
    std::string& name = thread.attributes.name;
    if (!is_reserved_name(name) || used.contains(name)) continue;
    if (is_realtime(thread.attributes.policy)) left_out.push_back("'" + name + "'");
    name += " (not simulated)";
  }
  if (left_out.empty()) return;
  notes_.push_back(
      fmt::format("not simulated: what Takt's own threads do: {}", fmt::join(left_out, ", ")));
}

// ---- A run ----

namespace {

/// Whether any number of arrivals may come at any time.
bool is_unbounded(const analysis::ArrivalCurve& arrivals) {
  return arrivals.most(1) == analysis::kUnbounded;
}

// Notes facts that no number covers, see `takt reference guarantees`, and arrivals at unknown
// rates.
void add_what_is_not_covered(const SystemModel& model, std::vector<std::string>& notes) {
  std::set<std::string> texts;
  const auto add = [&](const std::vector<Assumption>& assumptions) {
    for (const Assumption& each : assumptions) {
      if (each.state == Assumption::State::not_covered) texts.insert(each.text);
    }
  };
  add(model.assumptions);
  for (const SystemModel::Chain& chain : model.chains) add(chain.assumptions);
  for (const analysis::Callback& callback : model.system.callbacks) {
    if (!callback.arrivals || !is_unbounded(*callback.arrivals)) continue;
    texts.insert("what comes to '" + callback.name + "' besides: nothing tells how often");
  }
  for (const std::string& text : texts) notes.push_back("not simulated: " + text);
}

/// A source of events from outside of the executors.
struct Source {
  TimePoint next;
  std::function<TimePoint()> happen;  // returns the time of the next event
};

/// Call it after all threads have started: otherwise the first releases depend on their start.
void set_phases(const ModelledProcess& process, const SystemModel& model, FirstReleases& first) {
  for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
    auto* const timer = dynamic_cast<Timer*>(process.callbacks[i].entity.get());
    if (timer == nullptr || timer->is_canceled()) continue;
    timer->release_at(first.of(model.system.callbacks[i].name, timer->period()));
  }
}

/// Whether another subscription of the topic is the source of its arrivals from outside: the one
/// that expects the fewest, because each subscription gets all of them.
bool comes_with_another(const ModelledProcess& process, const SystemModel& model,
                        std::size_t callback) {
  const auto is_of_topic = [&](std::size_t other) {
    const Entity &one = *process.callbacks[callback].entity,
                 &two = *process.callbacks[other].entity;
    return one.kind() == EntityKind::subscription && two.kind() == EntityKind::subscription &&
           one.topic() == two.topic();
  };
  for (std::size_t other = 0; other < process.callbacks.size(); ++other) {
    if (other == callback || !is_of_topic(other) || !model.system.callbacks[other].arrivals)
      continue;
    const bool is_first = other < callback;
    const analysis::Time its = model.system.callbacks[other].arrivals->least_distance(10);
    const analysis::Time own = model.system.callbacks[callback].arrivals->least_distance(10);
    if (its > own || (its == own && is_first)) return true;
  }
  return false;
}

std::vector<Source> sources_of(const ModelledProcess& process, const SystemModel& model,
                               FirstReleases& first, SimulatedBodies& bodies, RunRefusal& refusal) {
  std::vector<Source> sources;
  for (std::size_t i = 0; i < process.callbacks.size(); ++i) {
    const analysis::Callback& callback = model.system.callbacks[i];
    if (callback.is_timer || !callback.arrivals || is_unbounded(*callback.arrivals)) continue;
    Entity& entity = *process.callbacks[i].entity;
    if (dynamic_cast<const TaskRunner*>(&entity) != nullptr || entity.kind() == EntityKind::timer)
      continue;  // running code resumes its coroutines, and sets its alarms
    if (comes_with_another(process, model, i)) continue;
    std::function<void()> arrive;
    if (entity.kind() == EntityKind::subscription) {
      arrive = [publisher = &bodies.publisher_for(entity)] { publisher->publish(); };
    } else if (auto* const condition = dynamic_cast<GuardCondition*>(&entity)) {
      arrive = [condition] { condition->trigger(); };
    } else {
      throw Error(fmt::format("cannot simulate the `arrival` of '{}', which is no subscription and "
                              "no guard condition",
                              callback.name),
                  "leave it out, and let a timer stand for it");
    }
    const Nanoseconds distance(callback.arrivals->least_distance(2));
    Arrivals arrivals(*callback.arrivals, first.of(callback.name, distance));
    const TimePoint next = arrivals.next();
    sources.push_back({next, [arrivals = std::move(arrivals), arrive = std::move(arrive), &refusal,
                              name = callback.name]() mutable {
                         refusal.count(name);
                         arrive();
                         arrivals.take();
                         return arrivals.next();
                       }});
  }
  return sources;
}

void add_late_messages(std::vector<Source>& sources, FaultInjection& faults) {
  for (const TimePoint time : faults.late_times()) {
    sources.push_back({time, [&faults] {
                         faults.deliver_late();
                         return kNever;
                       }});
  }
}

/// Advances the clock to `end`. Events from outside and messages between processes come after all
/// other events of the same instant. False: `stops` has ended it.
bool advance(ManualClock& clock, TimePoint end, std::vector<Source>& sources, Wire& wire,
             const std::atomic<bool>* stops, const std::function<void()>& check) {
  const auto is_stopped = [&] { return stops != nullptr && stops->load(); };
  while (clock.now() < end && !is_stopped()) {
    Source* first = nullptr;
    TimePoint time = std::min(end, later(clock.now(), std::chrono::seconds(1)));  // for `check`
    time = std::min(time, wire.next());
    for (Source& source : sources) {
      if (source.next > time || (first != nullptr && source.next == time)) continue;
      first = &source;
      time = source.next;
    }
    clock.advance(time - clock.now(), stops);
    if (wire.next() <= clock.now()) {  // also messages sent meanwhile
      wire.arrive();
      clock.settle(stops);
    }
    if (first != nullptr && clock.now() == time) {
      first->next = first->happen();
      clock.settle(stops);
    }
    check();
  }
  return !is_stopped();
}

void add_notes(SimulatedRun& run, const std::vector<std::string>& more) {
  run.result.notes.insert(run.result.notes.end(), more.begin(), more.end());
}

void add_changes(SimulatedRun& run, const std::vector<CpuModel::Change>& changes,
                 const std::map<const CpuModel::Thread*, int>& numbers) {
  const auto number_of = [&](const CpuModel::Thread* thread) {
    const auto found = numbers.find(thread);
    return found != numbers.end() ? found->second : 0;
  };
  for (const CpuModel::Change& change : changes) {
    run.changes.push_back({change.time, change.cpu, number_of(change.before),
                           number_of(change.after), change.was_preempted});
  }
}

ContainerOverrides simulated(ContainerOverrides overrides, ManualClock& clock,
                             ExecutionModel& bodies) {
  overrides.clock = &clock;
  overrides.execution_model = &bodies;
  overrides.only_constructs = true;  // so tracepoints are not loaded
  return overrides;
}

}  // namespace

ManualClock Simulation::make_clock(const Scenario& scenario) const {
  const MeasuredModel* const measured = options_.measured ? &*options_.measured : nullptr;
  return {kSimulationBegin, machine_of(system_, measured, scenario)};
}

SimulatedRun Simulation::run(Scenario scenario, ManualClock& clock) const {
  const MeasuredModel* const measured = options_.measured ? &*options_.measured : nullptr;
  const bool draws = scenario.times == Scenario::Times::drawn;
  FaultInjection faults(clock);
  Wire wire(clock, faults, draws, ~(2 * scenario.seed));
  RunRefusal refusal(clock);
  SimulatedBodies bodies(clock, draws, 2 * scenario.seed, faults, refusal, options_.running);
  FirstReleases first(scenario, options_.duration);
  std::vector<Source> sources;
  std::vector<CpuModel::Change> changes;  // outlives the containers: the clock moves until they end
  SimulatedProcesses processes(system_, processes_, simulated(options_.overrides, clock, bodies));
  const ModelledProcess& all = processes.all();  // served as the mode says
  const SystemModel model =
      make_system_model(modelled_, processes.chains(), processes.modelled(), measured);
  check_scales(all, model);
  bodies.set_up(
      all, model, processes.chains(),
      drawn_overhead(system_.machine.dispatch, measured, &MeasuredModel::dispatch_overhead));
  const FaultyCallbacks faulty(all, model);
  if (scenario.faults.empty())
    scenario.faults = faulty.drawn(options_.faults, scenario.seed, options_.duration);
  faulty.check(scenario.faults);
  faults.set_up(scenario.faults, later(kSimulationBegin, Nanoseconds(1)), all, model);
  if (processes.are_several()) wire.set_up(system_, processes.modelled(), model);
  bring_up(all);
  if (options_.overrides.trace_events != 0) clock.record(changes);
  processes.start(wire);
  set_phases(all, model, first);
  sources = sources_of(all, model, first, bodies, refusal);
  add_late_messages(sources, faults);
  std::vector<SimulatedRun::Release> releases = first.all();
  processes.release();
  const TimePoint end = later(kSimulationBegin, options_.duration);
  const bool is_complete = advance(clock, end, sources, wire, options_.stops.get(), [&] {
    if (!refusal.what().empty()) refuse(system_, refusal.what(), refusal.instead());
  });
  refusal.end();
  if (!is_complete) return {.scenario = std::move(scenario), .result = {}, .was_stopped = true};
  const std::vector<ManualClock::Use> use = clock.use();
  faults.end();
  bodies.end();
  clock.end_overheads();  // waking all threads at the end is not part of the system
  processes.end(clock, wire);
  SimulatedRun run{.scenario = std::move(scenario),
                   .result = processes.result(),
                   .executions = bodies.executions(),
                   .releases = std::move(releases),
                   .moments = bodies.longest_instances()};
  if (processes.are_several()) run.result.chains = bodies.chains();
  add_changes(run, changes, set_virtual(run.result, use, options_.duration));
  add_what_is_not_covered(model, run.result.notes);
  add_notes(run, wire.notes());
  add_notes(run, bodies.notes());
  add_notes(run, faulty.notes(options_.faults));
  if (!run.scenario.faults.empty())
    add_notes(run, {"these runs have faults, and bounds are of runs without"});
  return run;
}

Nanoseconds Simulation::time_to_begin() const {
  const MeasuredModel* const measured = options_.measured ? &*options_.measured : nullptr;
  return Nanoseconds(overheads_of(system_.machine, measured).wake + 1);
}

void Simulation::check_scales(const ModelledProcess& process, const SystemModel& model) const {
  std::vector<std::string> names;
  for (const analysis::Callback& callback : model.system.callbacks) names.push_back(callback.name);
  for (const ModelledProcess::Member& member : process.nodes)
    names.push_back(member.node->fully_qualified_name());
  for (const auto& [name, scale] : system_.execution_scales) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    throw Error(fmt::format("no callback and no node is called '{}'", name), suggest(name, names));
  }
}

// Brings up the nodes that a lifecycle manager would, in its order.
void Simulation::bring_up(const ModelledProcess& process) const {
  for (const std::string& name : bring_up_) {
    for (const ModelledProcess::Member& member : process.nodes) {
      auto* const node = dynamic_cast<LifecycleNode*>(member.node.get());
      if (node == nullptr || node->fully_qualified_name() != name) continue;
      node->configure();
      node->activate();
      if (node->get_current_state() == LifecycleState::active) continue;
      throw Error(fmt::format("cannot simulate '{}': it does not become active", name),
                  "see what its on_configure and on_activate return", system_.file);
    }
  }
}

}  // namespace takt
