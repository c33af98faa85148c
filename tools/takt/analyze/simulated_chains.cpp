// Simulations beside an analysis.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/simulation/first_releases.hpp"
#include "takt/containers/simulation/scenario_search.hpp"
#include "takt/measuring/output.hpp"

#include "analyze/analyzed_file.hpp"
#include "exit_status.hpp"
#include "run/end_signals.hpp"
#include "simulate/replay.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// The same system, as options of `takt simulate` say it.
SimulatedFile simulated_file(const SystemDescription& system, const AnalyzeOptions& options) {
  SimulatedFile file{.file = system.file,
                     .model = options.model,
                     .as = options.as,
                     .executor = options.overrides.executor,
                     .scheduler = options.overrides.scheduler};
  if (options.overrides.placement == Placement::merged) file.placement = "merged";
  if (!system.modes.empty()) file.mode = "normal";
  for (const Setting& setting : options.settings)
    file.settings.push_back(setting.path + "=" + setting.value);
  return file;
}

/// What the analysis takes from this machine, and a simulation does not; empty: nothing.
std::string why_machines_differ(const SystemDescription& system, const AnalyzeOptions& options) {
  if (options.measures_overheads)
    return "the overheads are those of this machine; write them to `machine: overheads`";
  if (has_usual_grant(system)) return {};
  return fmt::format(
      "Linux grants {} to real-time threads here; write that to `machine: "
      "{{rt_runtime: …}}`",
      to_string(realtime_grant()));
}

/// The longest instance of the chain that came closest to its deadline, as report.py draws it.
json worst_schedule(const SystemDescription& system, const SimulationOptions& how,
                    const ScenarioSearch& search) {
  const auto chain = search.closest_to_deadline();
  if (!chain) return {};
  const ScenarioSearch::Worst& worst = search.worst()[*chain];
  const TracedScenario traced = tools::traced(system, how, worst.scenario, system.file);
  const std::vector<Nanoseconds>& moments = traced.run.moments.at(*chain);
  const auto [release, end] = std::minmax_element(moments.begin(), moments.end());
  if (release == end) return {};  // it had no instances
  json all = trace_json(traced.trace);
  const std::int64_t trace_begin_ns = traced.trace.about.at("begin_ns");
  const auto in_trace = [&](Nanoseconds moment) {
    return rt::us(later(kSimulationBegin, Nanoseconds(1) + moment).time_since_epoch() -
                  Nanoseconds(trace_begin_ns));
  };
  json result{{"chain", worst.chain},
              {"scenario", to_string(worst.scenario)},
              {"release_us", in_trace(*release)},
              {"end_us", in_trace(*end)},
              {"traceEvents", json::array()}};
  for (json& event : all["traceEvents"]) {
    const bool is_name = event["ph"] == "M";
    if (!is_name && (event["ph"] != "X" || event["ts"] > result["end_us"] ||
                     event["ts"].get<double>() + event["dur"].get<double>() < result["release_us"]))
      continue;
    result["traceEvents"].push_back(std::move(event));
  }
  return result;
}

}  // namespace

const SimulatedChains::Chain* SimulatedChains::find(std::string_view name) const {
  const auto found = std::find_if(chains.begin(), chains.end(),
                                  [&](const Chain& chain) { return chain.name == name; });
  return found != chains.end() ? &*found : nullptr;
}

SimulatedChains simulate_chains(const SystemDescription& system, const AnalyzeOptions& options) {
  SimulatedFile file = simulated_file(system, options);
  SimulatedChains result{.duration = file.duration};
  if (!options.nodes.is_null()) {
    result.why_not = "a program for rclcpp runs by itself";
    return result;
  }
  result.why_not = why_machines_differ(system, options);
  if (!result.why_not.empty()) return result;
  const auto stops = std::make_shared<std::atomic<bool>>(false);
  EndSignals signals(EndSignals::Command::looks, [stops] { stops->store(true); });
  const StaysOnOneCpu here;
  ScenarioSearch search(1);
  try {
    SimulationOptions how = options_of(system, file);
    how.stops = stops;
    const Simulation simulation(system, how);
    result.notes = simulation.notes();
    // So that the command does the same on another machine.
    const std::vector<int>& cpus = simulation.system().machine.cpus;
    if (simulation.has_cpus_of_here() && std::cmp_equal(cpus.back() + 1, cpus.size()))
      file.cpus = cpus.size();
    for (result.runs = 0; result.runs < options.simulated_runs; ++result.runs) {
      result.signal = signals.take();
      if (result.signal != 0) break;
      const SimulatedRun simulated = simulation.run(search.next());
      if (simulated.was_stopped) {
        result.signal = signals.take();
        break;
      }
      if (!simulated.result.failures.empty())
        throw Error(fmt::format("{}", fmt::join(simulated.result.failures, "; ")));
      search.add(simulated, simulation.time_to_begin());
    }
    signals.end();
    if (options.draws_schedule && result.signal == 0)
      result.worst_schedule = worst_schedule(system, how, search);
  } catch (const Error& refused) {
    result.why_not = refused.what();
    return result;
  }
  if (result.runs == 0) throw Interrupted(result.signal, " before the first simulated run");
  for (const ScenarioSearch::Worst& worst : search.worst()) {
    result.chains.push_back({worst.chain, worst.latency, to_string(worst.scenario),
                             replay_command(file, worst.scenario)});
  }
  return result;
}

}  // namespace takt::tools
