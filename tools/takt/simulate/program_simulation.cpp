// SPDX-License-Identifier: Apache-2.0
#include "simulate/program_simulation.hpp"

#include <filesystem>
#include <utility>

#include "takt/measuring/json_text.hpp"

#include "commands.hpp"
#include "run/program.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// What the program has to know besides its file.
json how_of(const Simulation& simulation, const SimulatedFile& file, const std::string& faults,
            const Scenario& scenario) {
  const SystemDescription& system = simulation.system();
  const std::string& model = file.model.empty() ? system.model : file.model;
  json settings = json::object();
  for (const Setting& setting : settings_of(file)) settings[setting.path] = setting.value;
  json scales = json::object();
  for (const auto& [name, scale] : system.execution_scales) scales[name] = scale;
  return {{"scenario", to_string(scenario)},
          {"duration_ns", parse_run_time(file.duration).count()},
          {"cpus", system.machine.cpus},
          {"speed", file.speed},
          {"settings", settings},
          {"scales", scales},
          {"mode", file.mode},
          {"model", model.empty() ? "" : std::filesystem::absolute(model).string()},
          {"faults", faults}};
}

}  // namespace

SimulatedOnce simulate_program(const Simulation& simulation, const SimulatedFile& file,
                               const std::string& faults, const Scenario& scenario,
                               std::size_t trace_events) {
  ProgramResults done =
      results_of_program({.words = program_words(),
                          .file = file.file,
                          .executor = file.executor,
                          .placement = file.executor.empty() ? "" : file.placement,
                          .scheduler = file.scheduler,
                          .trace_events = trace_events,
                          .has_stdout = false,
                          .simulated = rt::json_text(how_of(simulation, file, faults, scenario))});
  if (!done.failed.empty()) throw std::runtime_error(done.failed.front());
  const json& written = done.written;
  SimulatedOnce once{
      .simulated = {.scenario = parse_scenario(written.at("scenario").get<std::string>()),
                    .result = {}},
      .run = rt::read_runs(written, "the program's results: ").at(0),
      .signal = done.signal};
  for (const json& release : written.at("releases")) {
    once.simulated.releases.push_back({release.at(0).get<std::string>(),
                                       Nanoseconds(release.at(1).get<std::int64_t>()),
                                       Nanoseconds(release.at(2).get<std::int64_t>())});
  }
  for (const json& chain : written.at("moments")) {
    std::vector<Nanoseconds>& moments = once.simulated.moments.emplace_back();
    for (const json& moment : chain) moments.emplace_back(moment.get<std::int64_t>());
  }
  for (const json& change : written.at("changes")) {
    once.simulated.changes.push_back({TimePoint(Nanoseconds(change.at(0).get<std::int64_t>())),
                                      change.at(1).get<int>(), change.at(2).get<int>(),
                                      change.at(3).get<int>(), change.at(4).get<bool>()});
  }
  once.simulated.result.chains = once.run.chains;
  return once;
}

}  // namespace takt::tools
