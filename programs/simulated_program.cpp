// SPDX-License-Identifier: Apache-2.0
#include "takt/programs/simulated_program.hpp"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/steady_clock.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/run.hpp"
#include "takt/programs/results.hpp"

extern "C" [[gnu::weak]] void takt_simulated_is_loaded() noexcept;

namespace takt::programs {
namespace {

using nlohmann::json;

// What libtakt_simulated.so asks may come from any thread, and before all that this file has.
constinit std::atomic<bool> is_under_way{false};
constinit std::atomic<const std::string*> running{nullptr};  // the callback whose body runs

SystemDescription read_file(const json& how, const std::string& path) {
  Settings settings;
  for (const auto& [key, value] : how.at("settings").items())
    settings.push_back({key, value.get<std::string>()});
  SystemDescription file = read_system(path, settings);
  file.machine.cpus = how.at("cpus").get<std::vector<int>>();
  for (const auto& [name, scale] : how.at("scales").items())
    file.execution_scales[name] = scale.get<double>();
  return file;
}

void refuse_what_is_not_seen() {
  if (takt_simulated_is_loaded == nullptr)
    refuse("runs without libtakt_simulated.so, as one with file capabilities does");
  using Threads = std::filesystem::directory_iterator;
  if (std::distance(Threads("/proc/self/task"), Threads()) > 1)
    refuse("has threads when it calls rclcpp::init");
}

}  // namespace

SimulatedProgram::SimulatedProgram(const std::string& how, const std::string& path_of_file,
                                   ContainerOverrides overrides)
    : file_(read_file(rt::parse_json(how), path_of_file)) {
  const json options = rt::parse_json(how);
  scenario_ = parse_scenario(options.at("scenario").get<std::string>());
  overrides.mode = options.at("mode").get<std::string>();
  SimulationOptions simulated{
      .overrides = std::move(overrides),
      .measured = {},
      .duration = Nanoseconds(options.at("duration_ns").get<std::int64_t>()),
      .speed = options.at("speed").get<double>(),
      .running = &running};
  if (const auto model = options.at("model").get<std::string>(); !model.empty())
    simulated.measured = read_measured_model(model);
  if (const auto faults = options.at("faults").get<std::string>(); !faults.empty())
    simulated.faults = parse_fault_kinds(faults);
  simulation_ = std::make_unique<Simulation>(file_, std::move(simulated));
  clock_ = std::unique_ptr<ManualClock>(new ManualClock(simulation_->make_clock(scenario_)));
  is_under_way.store(true);
  refuse_what_is_not_seen();
  replace_steady_clock(*clock_);
}

void SimulatedProgram::run(const std::string& results) {
  has_run_ = true;
  const struct End {
    ~End() { is_under_way.store(false); }
  } end{};
  SimulatedRun done = simulation_->run(scenario_, *clock_);
  std::erase_if(done.result.callbacks, [](const auto& row) {
    const CallbackStatistics& of = row.statistics;
    return is_parameter_service(of.node, of.kind, of.callback);
  });
  json document;
  document["scenario"] = to_string(done.scenario);
  document["releases"] = document["moments"] = document["changes"] = json::array();
  for (const SimulatedRun::Release& release : done.releases)
    document["releases"].push_back(
        {release.callback, release.phase.count(), release.distance.count()});
  for (const std::vector<Nanoseconds>& chain : done.moments) {
    json& moments = document["moments"].emplace_back(json::array());
    for (const Nanoseconds moment : chain) moments.push_back(moment.count());
  }
  for (const SimulatedRun::Change& change : done.changes) {
    document["changes"].push_back({change.time.time_since_epoch().count(), change.cpu,
                                   change.before, change.after, change.was_preempted});
  }
  document["runs"] = rt::result_document({rt::run_of(std::move(done.result))}).at("runs");
  write_output(results, std::string(kTaktsJson) + rt::json_text(document) + '\n');
}

bool is_simulated() noexcept {
  return is_under_way.load();
}

void refuse(const std::string& does) noexcept {
  if (!is_simulated()) return;
  const std::string* const callback = running.load();
  const std::string where =
      callback != nullptr ? " in the callback '" + printable(*callback) + "'" : std::string();
  std::fprintf(stderr,
               "error: this program cannot be simulated: it %s%s; leave that out, or measure the "
               "program with `takt run`\n",
               printable(does).c_str(), where.c_str());
  std::_Exit(2);  // as of `takt` with a wrong file
}

}  // namespace takt::programs

// For libtakt_simulated.so: which function something that is none of Takt's has called.
extern "C" [[gnu::visibility("default")]] void takt_refuse_call(const char* function,
                                                                const char* caller) noexcept {
  takt::programs::refuse("calls " + std::string(function) + "() from " + caller);
}
