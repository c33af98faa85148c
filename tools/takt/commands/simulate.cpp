// takt simulate: a system under a virtual clock, on virtual CPUs.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/counted.hpp"
#include "takt/base/fields.hpp"
#include "takt/base/time.hpp"
#include "takt/base/version.hpp"
#include "takt/containers/simulation/scenario_search.hpp"
#include "takt/executors/figures.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run.hpp"

#include "analyze/analyzed_file.hpp"
#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/end_signals.hpp"
#include "run/live_line.hpp"
#include "run/program.hpp"
#include "run/result_json.hpp"
#include "run/result_tables.hpp"
#include "run/trace.hpp"
#include "simulate/program_simulation.hpp"
#include "simulate/replay.hpp"
#include "table.hpp"

namespace takt::tools::simulate_command {
namespace {

using nlohmann::json;

struct Options : SimulatedFile {
  std::string phases, times, replayed, trace, json;
  std::uint64_t seed = 1, runs = 1;
  std::string faults;
  bool histograms = false, searches = false;
};

/// The first run is the one in which everything comes at once and takes longest; the others look
/// elsewhere, unless the options say where.
Scenario scenario_of(const Options& options, std::uint64_t run) {
  Scenario scenario{.seed = options.seed + run};
  if (options.phases == "random" || (options.phases.empty() && run != 0)) scenario.phases.clear();
  if (options.times == "drawn" || (options.times.empty() && run % 2 == 1))
    scenario.times = Scenario::Times::drawn;
  return scenario;
}

// Limit: runs in the JSON of a simulation, at some kB each. At it: nothing runs. Seen: the error.
constexpr std::uint64_t kMostInJson = 10'000;

/// Of all runs: what does not grow with them, and for --json each.
struct Results {
  rt::Run sum;
  std::vector<ScenarioSearch::Worst> worst;  // by chain
  Scenario
      closest;  // in which a chain came closest to its deadline; the first one if there are none
  json runs = json::array();
  std::uint64_t count = 0;
  int signal = 0;  // came before all that were asked for
};

/// As if it had come after the others.
void merge(rt::Run& sum, const rt::Run& more) {
  for (std::size_t row = 0; row < sum.callbacks.size(); ++row)
    merge(sum.callbacks[row].statistics, more.callbacks.at(row).statistics);
  for (std::size_t row = 0; row < sum.chains.size(); ++row)
    merge(sum.chains[row].statistics, more.chains.at(row).statistics);
  sum.duration_s += more.duration_s;
}

/// What else is known of chains, by name.
struct Known {
  std::map<std::string, Nanoseconds> observed, bounds;
};

/// By the analysis of the same file, as `takt analyze` has it. Call it when no simulation is under
/// way: nodes have names.
Known known_of(SystemDescription system, const Simulation& simulation, const Options& options) {
  AnalyzeOptions how{.model = options.model, .overrides = {}};
  if (!program_words().empty()) how.nodes = nodes_of_program(program_words(), options.file);
  how.overrides.executor = options.executor;
  how.overrides.mode = options.mode;
  how.overrides.placement = parse_placement(options.placement);
  how.overrides.scheduler = options.scheduler;
  const MachineDescription& simulated = simulation.system().machine;
  system.machine.speed = simulated.speed;
  if (!has_usual_grant(system)) system.machine.rt_runtime = simulated.rt_runtime;
  const AnalyzedFile file = analyze_system(std::move(system), how);
  Known result;
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = file.model.chains[i];
    if (const auto bound = file.bounds.chains[i].bound) result.bounds[chain.name] = *bound;
    if (chain.observed != Nanoseconds::zero()) result.observed[chain.name] = chain.observed;
  }
  return result;
}

void print_worst(const Results& all, const Known& known) {
  const auto cell = [](const std::map<std::string, Nanoseconds>& times, const std::string& chain) {
    const auto found = times.find(chain);
    return found != times.end() ? microseconds(found->second) : "-";
  };
  Table table({"chain", "deadline", "observed", "simulated", "bound", "simulated by"});
  for (std::size_t i = 0; i < all.sum.chains.size(); ++i) {
    const rt::Run::Chain& chain = all.sum.chains[i];
    const bool has_deadline = chain.deadline != Nanoseconds::zero();
    table.add({chain.name, has_deadline ? microseconds(chain.deadline) : "-",
               cell(known.observed, chain.name),
               chain.statistics.instances == 0 ? "-" : microseconds(all.worst[i].latency),
               cell(known.bounds, chain.name), "--replay " + to_string(all.worst[i].scenario)});
  }
  table.print("the longest latencies: of the model's run, of these runs, and of any (in µs)");
}

json document_of(const Results& all, const Simulation& simulation, const Known& known,
                 const Options& options) {
  json result{{"takt", {{"version", TAKT_VERSION}}},
              {"simulated",
               {{"cpus", simulation.system().machine.cpus},
                {"notes", simulation.notes()},
                {"is_complete", all.signal == 0}}},
              {"runs", all.runs}};
  json& bounds = result["bounds_us"] = json::object();
  for (const auto& [chain, bound] : known.bounds) bounds[chain] = rt::us(bound);
  if (options.histograms) result["bucket_limits_us"] = rt::bucket_limits_us();
  return result;
}

SimulatedOnce run_once(const Simulation& simulation, const Options& options,
                       const Scenario& scenario) {
  if (!program_words().empty())
    return simulate_program(simulation, options, options.faults, scenario);
  SimulatedOnce once{.simulated = simulation.run(scenario), .run = {}};
  if (!once.simulated.result.failures.empty())
    throw std::runtime_error(fmt::format("{}", fmt::join(once.simulated.result.failures, "\n")));
  once.run = rt::run_of(std::exchange(once.simulated.result, {}));
  once.simulated.result.chains = once.run.chains;
  return once;
}

/// `stops`: of the simulation.
Results simulate(const Simulation& simulation, const std::shared_ptr<std::atomic<bool>>& stops,
                 const Options& options) {
  Results all;
  std::optional<EndSignals> signals;  // for as long as it simulates; a program has its own
  if (program_words().empty())
    signals.emplace(EndSignals::Command::looks, [stops] { stops->store(true); });
  ScenarioSearch search(options.seed);
  const LiveLine line("simulating");
  for (std::uint64_t& i = all.count; i < options.runs; ++i) {
    if (signals) all.signal = signals->take();
    if (all.signal != 0) break;
    SimulatedOnce once = run_once(simulation, options,
                                  !options.replayed.empty() ? parse_scenario(options.replayed)
                                  : options.searches        ? search.next()
                                                            : scenario_of(options, i));
    const SimulatedRun& simulated = once.simulated;
    if (simulated.was_stopped) {
      all.signal = signals->take();
      break;
    }
    search.add(simulated, simulation.time_to_begin());
    if (!signals) all.signal = once.signal;
    rt::Run& run = once.run;
    run.file = with_program(options.file);
    name_executor(run, options.as, options.executor, options.placement);
    run.scheduler = options.scheduler.empty() ? "file" : options.scheduler;
    run.repeat = i;
    run.processes.clear();  // of this machine
    run.trace.reset();
    if (!options.json.empty()) {
      all.runs.push_back(rt::run_json(run, options.histograms));
      all.runs.back()["scenario"] = to_string(simulated.scenario);
    }
    if (i == 0) {
      all.closest = simulated.scenario;
      all.sum = std::move(run);
    } else {
      merge(all.sum, run);
    }
  }
  all.worst = search.worst();
  if (const auto chain = search.closest_to_deadline()) all.closest = all.worst[*chain].scenario;
  return all;
}

[[noreturn]] void throw_interrupted(const Results& all, const Options& options) {
  throw Interrupted(all.signal,
                    fmt::format(" when {} of {} runs were complete", all.count, options.runs));
}

void check_program(const Options& options) {
  const bool is_program = !program_words().empty();
  if (options.file.empty() && !is_program) throw CLI::RequiredError("FILE");
  if (options.file.empty()) {
    throw UsageError("a program is simulated with a FILE, which says how long its callbacks take",
                     "let it write one: TAKT_CONFIG_TEMPLATE");
  }
  if (is_program && !options.as.empty())
    throw UsageError("--as is for containers, not for a program", "leave it out");
}

/// The scenario runs once more: the other runs recorded nothing.
Trace trace_of_closest(const Results& all, const SystemDescription& system,
                       const Simulation& simulation, const SimulationOptions& how,
                       const Options& options) {
  if (program_words().empty()) return traced(system, how, all.closest, options.file).trace;
  SimulatedOnce once = simulate_program(simulation, options, "", all.closest, kMostTraceEvents);
  once.run.file = with_program(options.file);
  return trace_of(once.simulated.changes, std::move(once.run), false);
}

void run(const Options& options) {
  check_program(options);
  if (!options.json.empty() && options.runs > kMostInJson) {
    throw UsageError(fmt::format("--json has each run, of at most {}", kMostInJson),
                     "make fewer runs, or leave it out");
  }
  const SystemDescription system = system_of(options);
  const StaysOnOneCpu here;
  SimulationOptions how = options_of(system, options);
  if (!options.faults.empty()) how.faults = parse_fault_kinds(options.faults);
  const auto stops = std::make_shared<std::atomic<bool>>(false);
  how.stops = stops;
  const Simulation simulation(system, how);
  const Results all = simulate(simulation, stops, options);
  if (all.count == 0) throw_interrupted(all, options);
  std::set<std::string> notes(simulation.notes().begin(), simulation.notes().end());
  notes.insert(all.sum.notes.begin(), all.sum.notes.end());
  const Known known = known_of(system, simulation, options);
  const bool prints = options.json != "-";
  if (prints) {
    for (const std::string& note : notes) rt::to_stderr("note: {}\n", note);
    rt::print("simulated: {} of {} on CPUs {}{}\n\n", counted(all.count, "run"), options.duration,
              fmt::join(simulation.system().machine.cpus, ","),
              options.replayed.empty() ? fmt::format(", from seed {}", options.seed) : "");
    print_result(all.sum);
    print_worst(all, known);
  }
  if (!options.json.empty()) write_json(document_of(all, simulation, known, options), options.json);
  if (!options.trace.empty() && all.signal == 0)
    write_trace(trace_of_closest(all, system, simulation, how, options), options.trace);
  if (all.signal != 0) throw_interrupted(all, options);
  if (std::any_of(all.sum.chains.begin(), all.sum.chains.end(),
                  [](const rt::Run::Chain& chain) { return chain.statistics.misses != 0; })) {
    throw CLI::RuntimeError(kFailed);
  }
}

/// Which scenarios are run.
void add_scenario_options(CLI::App& command, Options& options) {
  CLI::Option* const runs = command.add_option(
      "--runs", options.runs, "So many runs, with the seeds from --seed on (default: 1)");
  whole_number(runs, 1, 1'000'000);
  whole_number(command.add_option("--seed", options.seed,
                                  "Another seed draws other phases and times (default: 1)"),
               0, 999'999'999'999'999);
  one_of(command.add_option("--phases", options.phases,
                            "First releases of timers and arrivals: all at once, or drawn "
                            "(default: equal in the first run, then random)"),
         {"equal", "random"});
  one_of(command.add_option("--times", options.times,
                            "Execution times: the longest, or drawn (default: worst, and drawn in "
                            "every second run)"),
         {"worst", "drawn"});
  auto* const search =
      command.add_flag("--search", options.searches,
                       "Each run goes on from where those before it found the longest latencies");
  search->needs(runs);
  for (const char* other : {"--phases", "--times"}) search->excludes(command.get_option(other));
  auto* const replay =
      command.add_option("--replay", options.replayed,
                         "Run this scenario again, as `simulated by` and the JSON show it");
  command.add_option("--faults", options.faults,
                     "LIST or all: in each run one to three of these happen: lost, late, doubled, "
                     "reordered messages, a full queue, a slow callback, one that throws");
  for (const char* other : {"--runs", "--seed", "--phases", "--times", "--search", "--faults"})
    replay->excludes(command.get_option(other));
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file,
                      "A configuration file; its components are made, and their code does not run");
  command->add_option("--model", options->model,
                      "A file of `takt model`, with measured execution times and arrivals");
  add_scenario_options(*command, *options);
  time_text(
      command->add_option("--duration", options->duration, "Virtual time of a run (default: 10s)"));
  command->add_option("--executor", options->executor,
                      "As for `takt run`: makes each executor of the file one of this type");
  placement_option(command, options->placement);
  command->add_option("--scheduler", options->scheduler, "As for `takt run`");
  as_option(*command, options->as);
  command->add_option("--mode", options->mode,
                      "Of the file's `modes:`: the one that is in force, as nothing switches here");
  whole_number(command->add_option("--cpus", options->cpus,
                                   "So many CPUs, from 0 on, instead of those of `machine:`"),
               1, 1024);
  number(command->add_option("--speed", options->speed,
                             "CPUs that are so many times as fast as those of the file"),
         0.001, 1000);
  command
      ->add_option("--scale", options->scales,
                   "NAME=FACTOR: executions of a callback, or of all callbacks of a node, take so "
                   "many times as long, as /planner/plan=1.5; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--set", options->settings,
                   "KEY=VALUE: another value for a key of the file, as "
                   "threads.control.priority=70; may be repeated")
      ->allow_extra_args(false);
  command->add_flag("--histograms", options->histograms, "Include histograms in the JSON");
  add_output(*command, "--trace", options->trace,
             "Write a timeline of the worst run, for ui.perfetto.dev or chrome://tracing");
  add_output(*command, "--json", options->json, "Also write the results as JSON; - for stdout");
  command->footer(
      "The executors, schedulers and groups of the file themselves, on virtual CPUs: nothing "
      "depends\n"
      "on this machine, and the same seed gives the same bytes. Exit 1: a chain missed its "
      "deadline.\n"
      "Examples:\n"
      "  takt simulate robot.yaml --duration 60s\n"
      "  takt simulate robot.yaml --model robot.model.yaml --runs 100 --search\n"
      "  takt simulate robot.yaml --model robot.model.yaml --replay 7,worst --trace worst.json\n"
      "  takt simulate robot.yaml --executor events --cpus 4\n"
      "With -- PROGRAM [ARGUMENT]... FILE is the TAKT_CONFIG of a program written for rclcpp, "
      "whose "
      "code\nruns.\n");
  command->callback([options] { run(*options); });
}
const Command registered("simulate",
                         "Runs a file under a virtual clock, and looks for its worst latencies",
                         set_up, Command::Takes::program);

}  // namespace
}  // namespace takt::tools::simulate_command
