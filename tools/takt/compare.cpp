// takt compare: the same system under each executor and scheduler, interleaved, in one table.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>

#include "commands.hpp"
#include "comparison.hpp"
#include "result_json.hpp"
#include "table.hpp"
#include "takt/containers/duration.hpp"
#include "takt/containers/system_description.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

struct Options {
  std::vector<std::string> files;
  std::string executors = "all", schedulers, duration = "5s", report, json;
  int repeat = 1;
};

/// "all", or a list with commas, every word of which must be registered.
template <class AnyRegistry>
std::vector<std::string> selection(const std::string& text, const AnyRegistry& registry) {
  if (text == "all") return registry.names();
  std::vector<std::string> names;
  for (const std::string& name : CLI::detail::split(text, ',')) {
    registry.check(name);
    names.push_back(name);
  }
  return names;
}

/// Runs this very program again, so that each run has a fresh process, and reads its JSON.
json run_again(std::vector<std::string> arguments) {
  std::array<int, 2> pipe_ends{};
  if (pipe(pipe_ends.data()) != 0) throw Error("no pipe: " + errno_message(errno));
  const pid_t child = fork();
  if (child < 0) throw Error("no process: " + errno_message(errno));
  if (child == 0) {
    dup2(pipe_ends[1], STDOUT_FILENO);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    execv("/proc/self/exe", argv.data());
    _exit(127);
  }
  close(pipe_ends[1]);
  std::string text;
  std::array<char, 65536> buffer;
  for (ssize_t size; (size = read(pipe_ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  }
  close(pipe_ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw Error(fmt::format("a run ended with status {}", WIFEXITED(status) ? WEXITSTATUS(status)
                                                                            : WTERMSIG(status)),
                "see its message above");
  }
  return json::parse(text).at("runs").at(0);
}

void add_run(Comparison& row, const json& run) {
  double wakeups = 0;
  Histogram latency;
  for (const json& callback : run.at("callbacks")) {
    const Histogram histogram = read_histogram(callback.at("latency_us"));
    if (callback.at("kind") == "timer") {
      row.timer_latency.merge(histogram);
      continue;
    }
    latency.merge(histogram);
    const auto sum = [&callback](const char* key, std::uint64_t& into) {
      into += callback.at(key).get<std::uint64_t>();
    };
    sum("received", row.received);
    sum("expected", row.expected);
    sum("lost", row.lost);
    sum("dropped", row.dropped);
    sum("late", row.late);
    sum("too_late", row.too_late);
    sum("deadline_misses", row.deadline_misses);
  }
  for (const json& thread : run.at("threads")) wakeups += thread.at("wakeups").get<double>();
  row.latency.merge(latency);
  const json& process = run.at("processes").at(0);
  row.p99_us.push_back(static_cast<double>(latency.percentile(0.99).count()) / 1e3);
  row.cpu_percent.push_back(process.at("cpu_percent"));
  row.wakeups_per_s.push_back(wakeups / run.at("duration_s").get<double>());
  row.pss_mb.push_back(process.at("pss_kb").get<double>() / 1024);
}

void print(const std::vector<Comparison>& rows, int repeats) {
  const bool has_schedulers = std::any_of(rows.begin(), rows.end(),
                                          [](const auto& row) { return !row.scheduler.empty(); });
  std::string file;
  for (std::size_t first = 0; first < rows.size();) {
    std::vector<std::string> header{"executor"};
    if (has_schedulers) header.emplace_back("scheduler");
    for (const char* name : {"received", "lost", "dropped", "late", "too_late", "misses", "p50", "p90",
                             "p99", "p99.9", "max", "timer_p99", "cpu_%", "wakeups/s", "pss_MB"}) {
      header.emplace_back(name);
    }
    Table table(header);
    file = rows[first].file;
    for (; first < rows.size() && rows[first].file == file; ++first) {
      const Comparison& row = rows[first];
      std::vector<std::string> cells{row.executor};
      if (has_schedulers) cells.push_back(row.scheduler);
      for (const std::uint64_t count : {row.received, row.lost, row.dropped, row.late, row.too_late,
                                        row.deadline_misses}) {
        cells.push_back(std::to_string(count));
      }
      for (const double fraction : {0.5, 0.9, 0.99, 0.999, 1.0}) {
        cells.push_back(microseconds(row.latency.percentile(fraction)));
      }
      cells.push_back(microseconds(row.timer_latency.percentile(0.99)));
      cells.push_back(fmt::format("{:.2f}", median(row.cpu_percent)));
      cells.push_back(fmt::format("{:.0f}", median(row.wakeups_per_s)));
      cells.push_back(fmt::format("{:.1f}", median(row.pss_mb)));
      table.add(std::move(cells));
    }
    table.print(fmt::format("{} ({} run{} each, interleaved; latency of subscriptions in µs, "
                            "publish → callback)",
                            file, repeats, repeats == 1 ? "" : "s"));
  }
}

void compare(const Options& options) {
  const std::vector<std::string> executor_names = selection(options.executors, executors());
  const std::vector<std::string> scheduler_names =
      options.schedulers.empty() ? std::vector<std::string>{""}
                                 : selection(options.schedulers, schedulers());
  parse_duration(options.duration);
  std::vector<Comparison> rows;
  for (const std::string& file : options.files) {
    read_system(file);
    for (const std::string& executor : executor_names) {
      for (const std::string& scheduler : scheduler_names) {
        rows.push_back({.file = file, .executor = executor, .scheduler = scheduler});
      }
    }
  }
  json runs = json::array();
  std::size_t done = 0;
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  for (int repeat = 0; repeat < options.repeat; ++repeat) {
    for (Comparison& row : rows) {
      if (shows_progress) {
        fmt::print(stderr, "\r\033[K{} of {}: {} {}", ++done,
                   rows.size() * static_cast<std::size_t>(options.repeat), row.executor,
                   row.scheduler);
      }
      std::vector<std::string> arguments{"takt",  "run",        row.file, "--executor",
                                         row.executor, "--duration", options.duration,
                                         "--json", "-",          "--histograms"};
      if (!row.scheduler.empty()) {
        arguments.insert(arguments.end(), {"--scheduler", row.scheduler});
      }
      json run = run_again(std::move(arguments));
      run["repeat"] = repeat;
      add_run(row, run);
      runs.push_back(std::move(run));
    }
  }
  if (shows_progress) fmt::print(stderr, "\r\033[K");
  if (options.json != "-") print(rows, options.repeat);
  if (!options.json.empty()) write_json(result_document(std::move(runs)), options.json);
  if (!options.report.empty()) {
    write_report(rows, options.report);
    fmt::print(stderr, "report: {}\n", options.report);
  }
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

void add_compare(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "compare", "The same system under each executor, interleaved, in one table");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->files, "Configuration files or iRobot JSON workloads")
      ->required();
  command->add_option("--executors", options->executors, "all, or a list: events,single_threaded");
  command->add_option("--schedulers", options->schedulers,
                      "all, or a list; without it each executor has its own");
  command->add_option("--duration", options->duration, "Of each run: 5s");
  command->add_option("--repeat", options->repeat, "Runs of each")->check(CLI::Range(1, 1000));
  command->add_option("--report", options->report, "Write an HTML page too");
  command->add_option("--json", options->json, "Write every run as JSON too; - for stdout");
  command->footer(
      "Example:\n  takt compare robot.yaml --executors all --duration 5s --repeat 3 "
      "--report robot.html\n");
  command->callback([options] { compare(*options); });
}

}  // namespace takt::tools
