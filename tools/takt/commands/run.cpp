// takt run: runs the system described by a file, and reports measurements.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/printable.hpp"
#include "takt/base/time.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/process_json.hpp"
#include "takt/sched/scheduler.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "prompt/values.hpp"
#include "run/child.hpp"
#include "run/end_signals.hpp"
#include "run/processes.hpp"
#include "run/program.hpp"
#include "run/result_files.hpp"
#include "run/result_json.hpp"
#include "run/trace.hpp"
#include "table.hpp"

namespace takt::tools::run_command {
namespace {

using nlohmann::json;

/// Executions kept for each thread; they take 5 MB.
constexpr std::size_t kTraceEvents = 65'536;

struct Options {
  std::string process;  // of a system whose parent is at the other end of the connection
  int connection = -1;
  std::string file, name, executor, scheduler, composition = "file", transport = "auto", duration,
                                               trace, recordings;
  ResultFiles results;
  std::vector<std::string> load;
  bool histograms = false;
};

/// "-" where nothing was measured.
std::string us(const json& value) {
  if (value.is_null()) return "-";
  return microseconds(from_us(value));
}

/// Of a histogram with a full bucket, percentiles are marked.
std::string percentile(const json& times, const char* which) {
  return us(times.at(which)) + (times.contains("saturated") ? "~" : "");
}

template <class T>
std::string text(const json& value) {
  return fmt::format("{}", value.get<T>());
}

/// A table whose first column is the process, if there are several.
class ProcessTable {
 public:
  ProcessTable(const json& run, std::vector<std::string> header)
      : several_(run.at("processes").size() > 1), table_(with("process", std::move(header))) {}
  void add(const json& process, std::vector<std::string> row) {
    table_.add(with(process.get<std::string>(), std::move(row)));
  }
  void print(const std::string& title) const { table_.print(title); }

 private:
  std::vector<std::string> with(const std::string& first, std::vector<std::string> row) const {
    if (several_) row.insert(row.begin(), first);
    return row;
  }
  const bool several_;
  Table table_;
};

void print_callbacks(const json& run) {
  ProcessTable table(run, {"executor", "node", "callback", "kind", "received", "lost", "dropped",
                           "overruns", "late", "too_late", "misses", "p50", "p90", "p99", "p99.9",
                           "max", "exec_p50", "exec_max"});
  for (const json& row : run.at("callbacks")) {
    const auto word = [&](const char* key) { return row.at(key).get<std::string>(); };
    const auto number = [&](const char* key) { return row.at(key).get<std::uint64_t>(); };
    const auto number_or_dash = [](const json& count) {
      return count.is_null() ? "-" : text<std::uint64_t>(count);
    };
    const json& latency = row.at("latency_us");
    const json& execution = row.at("execution_us");
    table.add(row.at("process"),
              {word("executor"), word("node"), word("callback"), word("kind"),
               std::to_string(number("received")),
               word("kind") == "timer" ? "-" : std::to_string(number("lost")),
               word("kind") == "timer" ? "-" : std::to_string(number("dropped")),
               std::to_string(number("overruns")), number_or_dash(row.at("late")),
               number_or_dash(row.at("too_late")), std::to_string(number("deadline_misses")),
               percentile(latency, "p50"), percentile(latency, "p90"), percentile(latency, "p99"),
               percentile(latency, "p999"), us(latency.at("max")), percentile(execution, "p50"),
               us(execution.at("max"))});
  }
  table.print("callbacks (latency and execution in µs; a timer's latency is due → start)");
}

/// As `SCHED_FIFO`, `SCHED_DEADLINE 2ms/10ms`, `SCHED_OTHER (refused)`.
std::string policy_text(const json& state) {
  std::string text = state.at("policy");
  if (state.contains("runtime_us")) {
    text += fmt::format(" {}ms/{}ms", state.at("runtime_us").get<double>() / 1e3,
                        state.at("period_us").get<double>() / 1e3);
  }
  return text + (state.contains("refused") ? " (refused)" : "");
}

void print_chains(const json& run) {
  ProcessTable table(run, {"chain", "instances", "misses", "aborted", "deadline", "p50", "p90",
                           "p99", "p99.9", "max"});
  for (const json& row : run.at("chains")) {
    const json& latency = row.at("latency_us");
    const bool has_deadline = row.at("deadline_us").get<double>() != 0;
    table.add(
        row.at("process"),
        {row.at("name"), text<std::uint64_t>(row.at("instances")),
         has_deadline && row.at("instances") != 0 ? text<std::uint64_t>(row.at("misses")) : "-",
         text<std::uint64_t>(row.at("aborted")), has_deadline ? us(row.at("deadline_us")) : "-",
         percentile(latency, "p50"), percentile(latency, "p90"), percentile(latency, "p99"),
         percentile(latency, "p999"), us(latency.at("max"))});
  }
  table.print("chains (release of the first callback → end of the last, in µs)");
}

void print_topics(const json& run) {
  if (run.at("topics").empty()) return;
  ProcessTable table(run, {"topic", "end", "matched", "messages", "uncopied", "lost", "transport"});
  for (const json& row : run.at("topics")) {
    table.add(row.at("process"),
              {row.at("topic"), row.at("is_writer") ? "publisher" : "subscription",
               text<std::uint64_t>(row.at("matched")), text<std::uint64_t>(row.at("messages")),
               text<std::uint64_t>(row.at("uncopied")), text<std::uint64_t>(row.at("lost")),
               row.at("transport")});
  }
  table.print("topics between processes (uncopied: sent or received without a copy)");
}

void print_threads(const json& run) {
  ProcessTable table(run, {"executor", "thread", "policy", "priority", "nice", "cpus", "cpu_%",
                           "spin_%", "wakeups"});
  for (const json& row : run.at("threads")) {
    const json& state = row.at("in_force");
    table.add(row.at("process"),
              {row.at("executor"), row.at("name"), policy_text(state),
               text<int>(state.at("priority")), text<int>(state.at("nice")),
               fmt::format("{}", fmt::join(state.at("affinity").get<std::vector<int>>(), ",")),
               fmt::format("{:.2f}", row.at("cpu_percent").get<double>()),
               fmt::format("{:.2f}", row.at("spin_percent").get<double>()),
               text<std::uint64_t>(row.at("wakeups"))});
  }
  table.print("threads (attributes in force)");
}

void print_processes(const json& run) {
  Table table({"process", "seconds", "cpu_%", "pss_MB", "allocations", "in_dds"});
  const auto count = [](const json& value) {
    return value.is_null() ? "-" : text<std::uint64_t>(value);
  };
  for (const json& row : run.at("processes")) {
    table.add({row.at("name"), fmt::format("{:.2f}", run.at("duration_s").get<double>()),
               fmt::format("{:.2f}", row.at("cpu_percent").get<double>()),
               fmt::format("{:.1f}", row.at("pss_kb").get<double>() / 1024),
               count(row.at("allocations_while_spinning")), count(row.at("allocations_in_dds"))});
  }
  table.print("processes (allocations: on executor threads, while spinning)");
}

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
  if (!options.name.empty() || options.composition != "file" || options.transport != "auto") {
    throw Error("--name, --composition and --transport are for containers, not for a program",
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
  SystemDescription system = read_system(options.file);
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

ContainerOverrides overrides(const Options& options) {
  return {.executor = options.name.empty() ? options.executor : "",
          .scheduler = options.scheduler,
          .trace_events = !options.trace.empty() ? kTraceEvents : 0};
}

/// What makes this program one process of the same system.
std::vector<std::string> words_of(const Options& options) {
  std::vector<std::string> words{"run", options.file};
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  add("--executor", options.executor);
  add("--scheduler", options.scheduler);
  add("--composition", options.composition);
  add("--transport", options.transport);
  add("--trace", options.trace);
  return words;
}

/// This process is a part of a system, and its parent controls it.
void serve_parent(const Options& options) {
  EndGuard guard(options.connection);  // also while the file and its libraries are read
  guard.begins();
  for (const SystemDescription& process : processes(options)) {
    if (process.name != options.process) continue;
    const int status = serve(process, overrides(options), options.connection, guard);
    if (status != 0) throw CLI::RuntimeError(status);
    return;
  }
  throw Error(fmt::format("there is no process '{}' any more", options.process),
              "leave the file as it is while it runs", options.file);
}

/// Whether a trigger or a period decides when the executor of a traced thread runs.
bool is_triggered(const std::vector<SystemDescription>& system, const json& thread,
                  const Options& options) {
  if (!options.executor.empty()) return false;  // an executor without
  for (const SystemDescription& process : system) {
    for (const ExecutorDescription& executor : process.executors) {
      const bool is_here = system.size() == 1 || process.name == thread.at("process");
      if (!is_here || executor.name != thread.at("executor")) continue;
      return executor.trigger.kind != TriggerOptions::Kind::any ||
             executor.trigger.let_period != Nanoseconds::zero();
    }
  }
  return false;
}

/// Which executors have run which callbacks, by name; those of several processes as in `analyze`.
json executors_json(const json& run, bool has_several_processes) {
  const auto name_of = [&](const json& row) {
    const std::string name = row.at("executor");
    return has_several_processes ? row.at("process").get<std::string>() + "/" + name : name;
  };
  std::map<std::string, const json*> threads;  // one of each executor that has run something
  for (const json& thread : run.at("trace")) threads[name_of(thread)] = &thread;
  json result = json::object();
  for (const json& callback : run.at("callbacks")) {
    const auto thread = threads.find(name_of(callback));
    if (thread == threads.end()) continue;
    json& executor = result[thread->first];
    executor["type"] = thread->second->at("executor_type");
    executor["scheduler"] = thread->second->at("scheduler");
    executor["callbacks"].push_back(callback.at("node").get<std::string>() + "/" +
                                    callback.at("callback").get<std::string>());
  }
  return result;
}

/// The timeline of the run.
void write_traced(json& run, const std::vector<SystemDescription>& system, const Options& options) {
  run["executors"] = executors_json(run, system.size() > 1);
  for (json& thread : run.at("trace")) {
    thread["is_prompt"] = thread.at("is_realtime") && !is_triggered(system, thread, options);
  }
  write_trace(make_trace(run), options.trace);
}

/// A variable that somebody exported long ago changes what runs.
void note_variables(const Options& options) {
  const auto note = [](const char* name, const char* given, const std::string& value) {
    if (given == nullptr || value.empty() || value != given) return;
    rt::to_stderr("note: {}={} is in force\n", name, value);
  };
  note("TAKT_EXECUTOR", std::getenv("TAKT_EXECUTOR"), options.executor);
  note("TAKT_SCHEDULER", std::getenv("TAKT_SCHEDULER"), options.scheduler);
}

/// As run_processes.
json run_system(const std::vector<SystemDescription>& system, const Options& options) {
  const Nanoseconds duration =
      options.duration.empty() ? Nanoseconds::zero() : parse_run_time(options.duration);
  if (!program_words().empty()) {
    return run_program({.words = program_words(),
                        .file = options.file,
                        .executor = options.executor,
                        .scheduler = options.scheduler,
                        .duration = duration,
                        .trace_events = overrides(options).trace_events,
                        .has_stdout = !options.results.use_stdout()});
  }
  note_variables(options);
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
  check_writable(options.trace);
  const std::vector<SystemDescription> system = processes(options);
  json run = run_system(system, options);
  const auto failed = run.at("failed").get<std::vector<std::string>>();
  run.erase("failed");
  const int signal = run.at("signal");
  run.erase("signal");
  run["file"] = options.name.empty() ? with_program(options.file) : "--name " + options.name;
  run["executor"] = options.executor.empty() ? "file" : options.executor;
  run["scheduler"] = options.scheduler.empty() ? "file" : options.scheduler;
  run["composition"] = options.composition;
  run["transport"] = options.transport;
  run["repeat"] = 0;
  if (!options.results.use_stdout()) {  // else they are in it
    for (const json& note : run.at("notes")) rt::to_stderr("note: {}\n", note.get<std::string>());
  }
  if (!options.trace.empty()) write_traced(run, system, options);
  run.erase("trace");
  run.erase("executors");
  if (options.results.any() && !options.histograms) {
    for (json& callback : run.at("callbacks")) {
      for (const char* times : {"latency_us", "waiting_us", "take_us", "execution_us"}) {
        callback.at(times).erase("histogram");
      }
    }
    for (json& chain : run.at("chains")) chain.at("latency_us").erase("histogram");
  }
  // Write the file first: a closed stdout must not lose it.
  json document = rt::result_document(json::array({run}));
  if (options.histograms) document["bucket_limits_us"] = rt::bucket_limits_us();
  options.results.write(document);
  if (!options.results.use_stdout()) {
    print_callbacks(run);
    print_chains(run);
    print_topics(run);
    print_threads(run);
    print_processes(run);
  }
  if (!failed.empty()) throw std::runtime_error(fmt::format("{}", fmt::join(failed, "\n")));
  check_complete(signal, /*ends_by_itself=*/!options.duration.empty());
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  CLI::Option* file = command->add_option("FILE", options->file,
                                          "A configuration file, or an iRobot JSON workload");
  CLI::Option* name =
      command
          ->add_option("--name", options->name,
                       "Instead of FILE: run an empty container with this name on DDS, into which "
                       "you load components (see: takt component)")
          ->excludes(file);
  command
      ->add_option(
          "--load", options->load,
          "With --name: the libraries it may load on request: off, index, any, or a folder in "
          "addition to the index; may be repeated for folders (default: index)")
      ->allow_extra_args(false)
      ->needs(name);
  command
      ->add_option(
          "--recordings", options->recordings,
          "With --name: the folder beneath which components that are loaded on request may "
          "write and read recordings (default: none)")
      ->needs(name);
  command
      ->add_option("--executor", options->executor,
                   "Run all components under one executor of this type (default: TAKT_EXECUTOR, "
                   "else as the file says; see: takt list executors)")
      ->envname("TAKT_EXECUTOR");
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
  options->results.add_options(command, "the results");
  command->add_flag("--histograms", options->histograms, "Include histograms in these");
  command->add_option("--trace", options->trace,
                      "Write a timeline for ui.perfetto.dev or chrome://tracing, and takt model");
  // Of a child of this command.
  command->add_option("--process", options->process)->group("");
  command->add_option("--connection", options->connection)->group("");
  command->footer(
      "With -- PROGRAM [ARGUMENT]... runs a program written for rclcpp, FILE as its "
      "TAKT_CONFIG.\n\n"
      "Example:\n"
      "  takt run robot.yaml --executor events --duration 10s\n"
      "  takt run --duration 10s -- takt ros2 run my_package my_program\n");
  command->callback([options] { run(*options); });
}
const Command registered(
    "run", "Runs the system described by a file, or a program; Ctrl-C ends it cleanly", set_up,
    Command::Takes::program);

}  // namespace
}  // namespace takt::tools::run_command
