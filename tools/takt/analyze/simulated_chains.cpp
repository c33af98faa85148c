// Simulations beside an analysis.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/simulation/scenario_search.hpp"

#include "analyze/analyzed_file.hpp"
#include "exit_status.hpp"
#include "run/end_signals.hpp"
#include "simulate/replay.hpp"

namespace takt::tools {
namespace {

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
  const Nanoseconds here = std::chrono::seconds(1) - throttled_realtime();
  if (system.machine.rt_runtime || here == Simulation::kUsualRtRuntime) return {};
  return fmt::format(
      "Linux grants {:g} ms of each second to real-time threads here; write that to `machine: "
      "{{rt_runtime: …}}`",
      static_cast<double>(here.count()) / 1e6);
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
  const EndSignals signals;
  const StaysOnOneCpu here;
  ScenarioSearch search(1);
  try {
    const Simulation simulation(system, options_of(system, file));
    result.notes = simulation.notes();
    // So that the command does the same on another machine.
    const std::vector<int>& cpus = simulation.system().machine.cpus;
    if (simulation.has_cpus_of_here() && std::cmp_equal(cpus.back() + 1, cpus.size()))
      file.cpus = cpus.size();
    for (result.runs = 0; result.runs < options.simulated_runs; ++result.runs) {
      result.signal = signals.take();
      if (result.signal != 0) break;
      const SimulatedRun simulated = simulation.run(search.next());
      if (!simulated.result.failures.empty())
        throw Error(fmt::format("{}", fmt::join(simulated.result.failures, "; ")));
      search.add(simulated, simulation.time_to_begin());
    }
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
