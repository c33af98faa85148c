// SPDX-License-Identifier: Apache-2.0
#include "simulate/replay.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/run.hpp"

#include "catalogue/catalogue.hpp"
#include "shell_word.hpp"

namespace takt::tools {

Settings settings_of(const SimulatedFile& file) {
  Settings result;
  for (const std::string& text : file.settings) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == text.npos) {
      throw Error(fmt::format("--set '{}' is no KEY=VALUE", text),
                  "write threads.control.priority=70");
    }
    result.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  return result;
}

namespace {

/// Of execution times.
std::map<std::string, double, std::less<>> scales_of(const SimulatedFile& file) {
  std::map<std::string, double, std::less<>> result;
  for (const std::string& text : file.scales) {
    const std::size_t equals = text.rfind('=');
    double scale = 0;
    if (equals != text.npos) {
      const char* const end = text.data() + text.size();
      const auto [read, error] = std::from_chars(text.data() + equals + 1, end, scale);
      if (error != std::errc() || read != end) scale = 0;
    }
    if (!(scale >= 0.001 && scale <= 1000)) {
      throw Error(fmt::format("--scale '{}' is no NAME=FACTOR, of 0.001 to 1000", text),
                  "write /planner/plan=1.5, or /planner=1.5 for all callbacks of the node");
    }
    if (!result.emplace(text.substr(0, equals), scale).second)
      throw Error(fmt::format("--scale has '{}' twice", text.substr(0, equals)), "leave one out");
  }
  return result;
}

}  // namespace

SystemDescription system_of(const SimulatedFile& file) {
  SystemDescription system = read_system_as(file.file, file.as, settings_of(file));
  // Only now: the file may have loaded them.
  if (!file.executor.empty()) executors().check(file.executor);
  if (!file.scheduler.empty()) schedulers().check(file.scheduler);
  system.execution_scales = scales_of(file);
  if (file.cpus != 0) {
    system.machine.cpus.resize(file.cpus);
    std::iota(system.machine.cpus.begin(), system.machine.cpus.end(), 0);
  }
  return system;
}

SimulationOptions options_of(const SystemDescription& system, const SimulatedFile& file) {
  SimulationOptions result{.overrides = {.executor = file.executor,
                                         .placement = parse_placement(file.placement),
                                         .scheduler = file.scheduler,
                                         .mode = file.mode},
                           .measured = {},
                           .duration = parse_run_time(file.duration),
                           .speed = file.speed};
  const std::string& model = file.model.empty() ? system.model : file.model;
  if (!model.empty()) result.measured = read_measured_model(model);
  return result;
}

bool has_usual_grant(const SystemDescription& system) {
  return system.machine.rt_runtime ||
         realtime_grant() == RealtimeGrant{.runtime = Simulation::kUsualRtRuntime};
}

std::string replay_command(const SimulatedFile& file, const Scenario& scenario) {
  std::string command = "takt simulate " + shell_word(file.file);
  const SimulatedFile usual;
  const auto add = [&](const char* option, const std::string& value, const std::string& without) {
    if (value != without) command += fmt::format(" {} {}", option, shell_word(value));
  };
  add("--model", file.model, usual.model);
  add("--as", file.as, usual.as);
  add("--executor", file.executor, usual.executor);
  add("--placement", file.placement, usual.placement);
  add("--scheduler", file.scheduler, usual.scheduler);
  add("--mode", file.mode, usual.mode);
  add("--cpus", std::to_string(file.cpus), std::to_string(usual.cpus));
  add("--speed", fmt::format("{}", file.speed), fmt::format("{}", usual.speed));
  for (const std::string& setting : file.settings) add("--set", setting, "");
  for (const std::string& scale : file.scales) add("--scale", scale, "");
  add("--duration", file.duration, usual.duration);
  add("--replay", to_string(scenario), "");
  return command;
}

Trace trace_of(const std::vector<SimulatedRun::Change>& changes, rt::Run run, bool are_several) {
  TraceFrame frame;
  frame.end = kNever;
  for (const SimulatedRun::Change& change : changes) {
    auto& event = frame.scheduling.events.emplace_back();
    event.time = change.time;
    event.cpu = change.cpu;
    event.thread = static_cast<std::uint32_t>(change.before);
    event.next_thread = static_cast<std::uint32_t>(change.after);
    event.was_preempted = change.was_preempted;
  }
  for (const rt::Run::Thread& thread : run.threads) {
    frame.scheduling.names[static_cast<std::uint32_t>(thread.in_force.tid)] =
        are_several ? thread.process + "/" + thread.name : thread.name;
  }
  if (!run.trace) run.trace.emplace();
  Trace trace = make_trace(
      run, are_several, [](const rt::Run::Traced&) { return false; }, frame);
  trace.about["machine"] = kSimulatedMachine;
  return trace;
}

TracedScenario traced(const SystemDescription& system, SimulationOptions options,
                      const Scenario& scenario, const std::string& file) {
  options.overrides.trace_events = kMostTraceEvents;
  options.stops = nullptr;
  const Simulation simulation(system, options);
  TracedScenario result{.run = simulation.run(scenario), .trace = {}};
  rt::Run run = rt::run_of(std::move(result.run.result));
  run.file = file;
  result.trace = trace_of(result.run.changes, std::move(run), simulation.has_several_processes());
  return result;
}

StaysOnOneCpu::StaysOnOneCpu() {
  static_cast<void>(available_cpus());  // of this process, before it keeps to one
  CPU_ZERO(&before_);
  static_cast<void>(sched_getaffinity(0, sizeof before_, &before_));
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(std::max(0, sched_getcpu())), &one);
  static_cast<void>(sched_setaffinity(0, sizeof one, &one));
}

StaysOnOneCpu::~StaysOnOneCpu() {
  static_cast<void>(sched_setaffinity(0, sizeof before_, &before_));
}

}  // namespace takt::tools
