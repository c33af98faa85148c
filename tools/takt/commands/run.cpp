// takt run: runs the system described by a file, and reports measurements.
// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/run.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/output_file.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/time.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/sched/scheduler.hpp"

#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "exit_status.hpp"
#include "model/extraction.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/child.hpp"
#include "run/end_signals.hpp"
#include "run/latencies_over_time.hpp"
#include "run/processes.hpp"
#include "run/program.hpp"
#include "run/result_files.hpp"
#include "run/result_json.hpp"
#include "run/result_tables.hpp"
#include "run/trace.hpp"

namespace takt::tools::run_command {
namespace {

struct Options {
  std::string process;  // of a system whose parent is at the other end of the connection
  int connection = -1;
  std::string file, name, as, executor, placement = "file", scheduler, composition = "file",
                                        transport = "auto", duration, trace,
                                        trace_clock = "monotonic", recordings;
  ResultFiles results;
  std::vector<std::string> load;
  bool histograms = false, watches_bounds = false, counts_allocations = false;
};

/// `content`: of the variable, which an error must name if nobody has given the option.
template <class Registry>
void check_name(const Registry& registry, const std::string& name, const char* variable,
                const char* content) {
  if (name.empty()) return;
  try {
    registry.check(name);
  } catch (const Error& error) {
    const bool is_given = content == nullptr || name != content;
    throw Error(printable(error.what()), "", is_given ? "" : variable);
  }
}

/// Call it when the file is read, which may load executors and schedulers.
void check_names(const Options& options) {
  check_name(executors(), options.executor, "TAKT_EXECUTOR", std::getenv("TAKT_EXECUTOR"));
  check_name(schedulers(), options.scheduler, "TAKT_SCHEDULER", std::getenv("TAKT_SCHEDULER"));
}

/// Of the option if it is given, else of the environment.
void choose_placement(Options& options, bool is_given) {
  if (is_given && options.executor.empty() && options.placement != "file") {
    throw Error("--placement merged is for an executor type that replaces those of the file",
                "give --executor, or leave it out");
  }
  const char* const value = std::getenv("TAKT_PLACEMENT");
  if (is_given || value == nullptr || *value == '\0') return;
  parse_placement(value, "TAKT_PLACEMENT");
  options.placement = value;
}

/// An empty container for components that are loaded later.
SystemDescription empty_container(const Options& options) {
  check_names(options);
  SystemDescription system;
  system.file = "--name " + options.name;
  system.name = options.name;
  system.dds.emplace();
  system.loads[system.name] = parse_load_policy(options.load, options.recordings);
  system.executors = {
      {.name = "default", .type = options.executor.empty() ? "single_threaded" : options.executor}};
  return system;
}

/// So that nobody learns it only from the first refused request.
void warn_if_it_loads_nothing(const SystemDescription& container) {
  try {
    load_policy(container).check();
  } catch (const Error& error) {
    rt::to_stderr("note: {}\n", error.what());
  }
}

/// Checks that all components of the system can be loaded later.
void prepare_for_loading(SystemDescription& system) {
  if (system.finds_chains || !system.chains.empty()) {
    throw Error("--composition dynamic: chains need their components from the start",
                "use single, or remove the chains from the file");
  }
  const auto is_default = [](const auto& executor) { return executor.name == "default"; };
  if (std::none_of(system.executors.begin(), system.executors.end(), is_default)) {
    system.executors.push_back({.name = "default"});
  }
}

/// The file that configures the program, if there is one.
std::vector<SystemDescription> file_of_program(const Options& options) {
  if (!options.name.empty() || !options.as.empty() || options.composition != "file" ||
      options.transport != "auto") {
    throw Error("--name, --as, --composition and --transport are for containers, not for a program",
                "leave them out, or leave out the program");
  }
  check_names(options);
  if (options.file.empty()) return {};
  return {read_system(options.file)};
}

/// The processes of the system, with the composition and transport of the options.
std::vector<SystemDescription> processes(const Options& options) {
  if (!program_words().empty()) return file_of_program(options);
  if (!options.name.empty()) return {empty_container(options)};
  SystemDescription system = read_system_as(options.file, options.as);
  check_names(options);
  const bool loads = options.composition == "dynamic";
  // Without DDS in the file, this is a measurement: parameter services would only distort it.
  const bool needs_dds = options.transport == "dds" || options.transport == "shm";
  if ((loads || needs_dds) && !system.dds) system.dds.emplace().parameter_services = false;
  if (needs_dds) system.dds->serves_own_process = true;
  if (options.transport == "shm") system.dds->shared_memory = SharedMemory::require;
  if (options.transport == "intra") system.dds.reset();
  if (loads) prepare_for_loading(system);
  std::vector<SystemDescription> result =
      split(system, options.composition == "per-node"          ? Composition::per_node
                    : loads || options.composition == "single" ? Composition::single
                                                               : Composition::file);
  if (options.transport == "intra" && result.size() > 1) {
    throw Error(fmt::format("--transport intra works in one process only, but this system has {}",
                            result.size()),
                "use auto, dds or shm, or --composition single");
  }
  return result;
}

/// Before the run: nobody builds anything anew until then.
nlohmann::json what_is_measured(const Options& options) {
  if (options.file.empty()) return nlohmann::json::object();
  nlohmann::json result = measured_with(read_system_as(options.file, options.as));
  if (options.transport != "auto") result["settings"]["--transport"] = options.transport;
  return result;
}

/// 0: until a signal.
Nanoseconds duration_of(const Options& options) {
  return options.duration.empty() ? Nanoseconds::zero() : parse_run_time(options.duration);
}

std::size_t trace_events(const Options& options) {
  return options.trace.empty() ? 0 : kMostTraceEvents;
}

ContainerOverrides overrides(const Options& options) {
  return {.executor = options.name.empty() ? options.executor : "",
          .placement = parse_placement(options.placement),
          .scheduler = options.scheduler,
          .trace_events = trace_events(options),
          .slices = slices_for(duration_of(options)),
          .watches_bounds = options.watches_bounds};
}

/// What makes this program one process of the same system.
std::vector<std::string> words_of(const Options& options) {
  std::vector<std::string> words{"run", options.file};
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  add("--as", options.as);
  add("--executor", options.executor);
  if (!options.executor.empty()) add("--placement", options.placement);
  add("--scheduler", options.scheduler);
  add("--composition", options.composition);
  add("--transport", options.transport);
  add("--trace", options.trace);
  add("--duration", options.duration);
  if (OutputFile::may_overwrite()) words.push_back("--force");
  return words;
}

/// This process is a part of a system, and its parent controls it.
void serve_parent(const Options& options) {
  EndSignals signals(options.connection);
  EndGuard guard(signals);  // also while the file and its libraries are read
  for (const SystemDescription& process : processes(options)) {
    if (process.name != options.process) continue;
    give_attributes(signals, process);
    const int status = serve(process, overrides(options), options.connection, guard);
    if (status != 0) throw CLI::RuntimeError(status);
    return;
  }
  throw Error(fmt::format("there is no process '{}' any more", options.process),
              "leave the file as it is while it runs", options.file);
}

/// Whether a trigger or a period decides when the executor of a traced thread runs, or it is awake
/// before: then it tells nothing of how long Linux and an executor need.
bool is_held_or_awake(const std::vector<SystemDescription>& system, const rt::Run::Traced& thread,
                      const Options& options) {
  const bool is_replaced = !options.executor.empty();
  const bool is_merged = is_replaced && parse_placement(options.placement) == Placement::merged;
  const bool may_be_held =
      !is_replaced || (!is_merged && executors().traits(options.executor).triggered);
  for (const SystemDescription& process : system) {
    for (const ExecutorDescription& executor : process.executors) {
      const bool is_here = system.size() == 1 || process.name == thread.process;
      if (!is_here || (!is_merged && executor.name != thread.executor)) continue;
      const bool is_held = executor.trigger.kind != TriggerOptions::Kind::any ||
                           executor.trigger.let_period != Nanoseconds::zero();
      const bool is_awake =
          executor.spin != Nanoseconds::zero() || executor.early_wake != Nanoseconds::zero();
      if (is_awake || (may_be_held && is_held)) return true;
    }
  }
  return false;
}

/// Somebody may expect all on one executor, as Takt once did.
void note_placement(const rt::Run& run, const Options& options) {
  if (options.executor.empty() || options.placement != "file") return;
  std::set<std::string> names;
  for (const rt::Run::Executor& executor : run.executors) names.insert(executor.name);
  if (names.size() < 2) return;
  rt::to_stderr(
      "note: --executor {}: the executors {} keep their threads; --placement merged puts all "
      "components of a process on one\n",
      options.executor, fmt::join(names, ", "));
}

/// Each process would know only its own part of what bounds rest on.
void check_watching(const std::vector<SystemDescription>& system, const Options& options) {
  const bool watches = options.watches_bounds ||
                       std::any_of(system.begin(), system.end(),
                                   [](const auto& process) { return process.watches_bounds; });
  if (!watches) return;
  const char* const what = options.watches_bounds ? "--watch-bounds" : "`analysis: {watch: true}`";
  const auto refuse = [&](const std::string& why) {
    throw Error(fmt::format("{} is for a file with one process: {}", what, why), "leave it out");
  };
  if (!program_words().empty()) refuse("this is a program");
  if (options.composition == "dynamic" || options.file.empty())
    refuse("components are loaded while it runs");
  if (options.transport == "dds" || options.transport == "shm")
    refuse("messages inside of it go through DDS");
  if (system.size() > 1) refuse(fmt::format("there are {}", system.size()));
}

/// As run_processes.
FinishedRun run_system(const std::vector<SystemDescription>& system, const Options& options) {
  const Nanoseconds duration = duration_of(options);
  if (!program_words().empty()) {
    return run_program({.words = program_words(),
                        .file = options.file,
                        .executor = options.executor,
                        .placement = options.executor.empty() ? "" : options.placement,
                        .scheduler = options.scheduler,
                        .duration = duration,
                        .trace_events = trace_events(options),
                        .counts_allocations = options.counts_allocations,
                        .has_stdout = !options.results.use_stdout()});
  }
  note_variables(options.executor, options.placement, options.scheduler);
  if (!options.name.empty()) warn_if_it_loads_nothing(system.front());
  return run_processes(system, {.overrides = overrides(options),
                                .duration = duration,
                                .loads = options.composition == "dynamic",
                                .apart = options.composition == "per-node",
                                .words = words_of(options)});
}

void run(const Options& options) {
  if (options.file.empty() && options.name.empty() && program_words().empty()) {
    throw Error("nothing to run",
                "give a FILE, a program after --, or --name for an empty container");
  }
  if (!options.process.empty()) return serve_parent(options);
  options.results.check();
  if (options.counts_allocations && program_words().empty()) {
    throw Error("--allocations is for a program: what containers allocate is always counted",
                "leave it out, or give a program after --");
  }
  const std::vector<SystemDescription> system = processes(options);
  check_watching(system, options);
  std::optional<TraceRecorder> recorder;
  nlohmann::json measured;
  if (!options.trace.empty()) {
    measured = what_is_measured(options);
    recorder.emplace(options.trace_clock);
  }
  auto [run, failed, signal] = run_system(system, options);
  run.file = options.name.empty() ? with_program(options.file) : "--name " + options.name;
  name_executor(run, options.as, options.executor, options.placement);
  run.scheduler = options.scheduler.empty() ? "file" : options.scheduler;
  run.composition = options.composition;
  run.transport = options.transport;
  run.repeat = 0;
  if (!options.results.use_stdout()) {  // else they are in it
    for (const std::string& note : run.notes) rt::to_stderr("note: {}\n", note);
    note_placement(run, options);
  }
  if (!options.trace.empty()) {
    if (!run.trace) run.trace.emplace();
    Trace trace = make_trace(
        run, system.size() > 1,
        [&](const rt::Run::Traced& thread) { return is_held_or_awake(system, thread, options); },
        recorder->end());
    trace.about.update(measured);
    write_trace(trace, options.trace);
  }
  run.trace.reset();
  // Write the file first: a closed stdout must not lose it.
  nlohmann::json document = rt::result_document({run}, options.histograms);
  if (options.histograms) document["bucket_limits_us"] = rt::bucket_limits_us();
  options.results.write(document, {run}, options.histograms);
  if (!options.results.use_stdout()) {
    print_result(run);
  }
  if (!failed.empty()) throw std::runtime_error(fmt::format("{}", fmt::join(failed, "\n")));
  check_complete(signal, /*ends_by_itself=*/!options.duration.empty());
}

/// Options of a container that is no file's.
void add_empty_container(CLI::App* command, Options& options, CLI::Option* file) {
  CLI::Option* name =
      command
          ->add_option("--name", options.name,
                       "Instead of FILE: run an empty container with this name on DDS, into which "
                       "you load components (see: takt component)")
          ->excludes(file);
  command
      ->add_option(
          "--load", options.load,
          "With --name: the libraries it may load on request: off, index, any, or a folder in "
          "addition to the index; may be repeated for folders (default: index)")
      ->allow_extra_args(false)
      ->needs(name);
  command
      ->add_option(
          "--recordings", options.recordings,
          "With --name: the folder beneath which components that are loaded on request may "
          "write and read recordings (default: none)")
      ->needs(name);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  CLI::Option* file = command->add_option("FILE", options->file,
                                          "A configuration file, or an iRobot JSON workload");
  add_empty_container(command, *options, file);
  command
      ->add_option("--executor", options->executor,
                   "Make each executor of the file one of this type (default: TAKT_EXECUTOR, "
                   "else as the file says; see: takt list executors)")
      ->envname("TAKT_EXECUTOR");
  CLI::Option* placement = placement_option(command, options->placement);
  command
      ->add_option("--scheduler", options->scheduler,
                   "Scheduler of every executor (default: TAKT_SCHEDULER, else as the file says; "
                   "see: takt list schedulers)")
      ->envname("TAKT_SCHEDULER");
  one_of(command->add_option("--composition", options->composition,
                             "Which components share a process (default: file)"),
         {"file", "single", "per-node", "dynamic"});
  one_of(command->add_option("--transport", options->transport,
                             "What messages go through (default: auto)"),
         {"auto", "intra", "dds", "shm"});
  time_text(command->add_option("--duration", options->duration,
                                "Duration of the run (default: until Ctrl-C)"));
  as_option(*command, options->as)->excludes("--name");
  options->results.add_options(command, "the results");
  command->add_flag("--histograms", options->histograms, "Include histograms in these");
  command->add_flag("--watch-bounds", options->watches_bounds,
                    "Compare what runs with what `takt analyze` assumes, and say what deviates");
  command->add_flag("--allocations", options->counts_allocations,
                    "Count what each callback of the program allocates, in glibc's heap; of "
                    "containers it is always counted");
  add_output(*command, "--trace", options->trace,
             "Write a timeline for ui.perfetto.dev or chrome://tracing, and takt model");
  trace_clock_option(command, options->trace_clock);
  // Of a child of this command.
  command->add_option("--process", options->process)->group("");
  command->add_option("--connection", options->connection)->group("");
  command->footer(
      "With -- PROGRAM [ARGUMENT]... runs a program written for rclcpp, FILE as its "
      "TAKT_CONFIG.\n\n"
      "Example:\n"
      "  takt run robot.yaml --executor events --duration 10s\n"
      "  takt run robot.yaml --as picas --duration 10s\n"
      "  takt run --duration 10s -- takt ros2 run my_package my_program\n");
  command->callback([options, placement] {
    choose_placement(*options, placement->count() != 0);
    run(*options);
  });
}
const Command registered(
    "run", "Runs the system described by a file, or a program; Ctrl-C ends it cleanly", set_up,
    Command::Takes::program);

}  // namespace
}  // namespace takt::tools::run_command
