// takt compare: runs a system under several executors and schedulers, and prints one table.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "commands.hpp"
#include "report.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "table.hpp"

namespace takt::tools::compare_command {
namespace {

using nlohmann::json;

struct Options {
  std::vector<std::string> files;
  std::string executors = "all", schedulers, compositions = "file", duration = "5s", report, json;
  int repeat = 1;
};

/// All repeats of one chain, in all processes that it passes through.
struct ChainComparison {
  std::uint64_t instances = 0, misses = 0, aborted = 0;
  Histogram latency;
};

/// All repeats of one file under one executor and scheduler.
struct Comparison {
  std::string file, executor, scheduler, composition = "file";
  Histogram latency;        // of all subscriptions, over all repeats
  Histogram timer_latency;  // due → start
  std::uint64_t received = 0, lost = 0, dropped = 0, deadline_misses = 0;
  std::optional<std::uint64_t> late, too_late;    // of publishers whose periods are known
  std::map<std::string, ChainComparison> chains;  // by name
  // One value for each repeat; tables show the median.
  std::vector<double> cpu_percent, wakeups_per_s, pss_mb;
};

/// The word for the executor or scheduler given in the file.
constexpr std::string_view kFile = "file";

/// Reads "all", or a list separated by commas of registered names and kFile.
template <class AnyRegistry>
std::vector<std::string> selection(const std::string& text, const AnyRegistry& registry) {
  if (text == "all") return registry.names();
  std::vector<std::string> names;
  for (const std::string& name : CLI::detail::split(text, ',')) {
    if (name != kFile) registry.check(name);
    names.push_back(name);
  }
  return names;
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
    sum("lost", row.lost);
    sum("dropped", row.dropped);
    const auto sum_known = [&callback](const char* key, std::optional<std::uint64_t>& into) {
      const json& count = callback.at(key);
      if (!count.is_null()) into = into.value_or(0) + count.get<std::uint64_t>();
    };
    sum_known("late", row.late);
    sum_known("too_late", row.too_late);
    sum("deadline_misses", row.deadline_misses);
  }
  for (const json& chain : run.at("chains")) {
    ChainComparison& sum = row.chains[chain.at("name")];
    sum.instances += chain.at("instances").get<std::uint64_t>();
    sum.misses += chain.at("misses").get<std::uint64_t>();
    sum.aborted += chain.at("aborted").get<std::uint64_t>();
    sum.latency.merge(read_histogram(chain.at("latency_us")));
  }
  for (const json& thread : run.at("threads")) wakeups += thread.at("wakeups").get<double>();
  row.latency.merge(latency);
  double cpu_percent = 0, pss_kb = 0;
  for (const json& process : run.at("processes")) {
    cpu_percent += process.at("cpu_percent").get<double>();
    pss_kb += process.at("pss_kb").get<double>();
  }
  row.cpu_percent.push_back(cpu_percent);
  row.wakeups_per_s.push_back(wakeups / run.at("duration_s").get<double>());
  row.pss_mb.push_back(pss_kb / 1024);
}

/// The cells that identify a row.
class Names {
 public:
  explicit Names(const std::vector<Comparison>& rows)
      : has_schedulers_(std::any_of(rows.begin(), rows.end(),
                                    [](const auto& row) { return !row.scheduler.empty(); })),
        has_compositions_(std::any_of(rows.begin(), rows.end(),
                                      [](const auto& row) { return row.composition != "file"; })) {}

  std::vector<std::string> header(const std::vector<std::string>& rest) const {
    return cells("executor", "scheduler", "composition", rest);
  }
  std::vector<std::string> row(const Comparison& row, const std::vector<std::string>& rest) const {
    return cells(row.executor, row.scheduler, row.composition, rest);
  }

 private:
  std::vector<std::string> cells(const std::string& executor, const std::string& scheduler,
                                 const std::string& composition,
                                 const std::vector<std::string>& rest) const {
    std::vector<std::string> cells{executor};
    if (has_schedulers_) cells.push_back(scheduler);
    if (has_compositions_) cells.push_back(composition);
    cells.insert(cells.end(), rest.begin(), rest.end());
    return cells;
  }
  const bool has_schedulers_, has_compositions_;
};

/// Of a histogram with a full bucket, percentiles are marked.
std::string percentile(const Histogram& latency, double fraction) {
  if (latency.count() == 0) return "-";
  return microseconds(latency.percentile(fraction)) + (latency.is_saturated() ? "~" : "");
}

std::vector<std::string> percentiles(const Histogram& latency) {
  std::vector<std::string> cells;
  for (const double fraction : {0.5, 0.9, 0.99, 0.999, 1.0}) {
    cells.push_back(percentile(latency, fraction));
  }
  return cells;
}

void print(const std::vector<Comparison>& rows, int repeats) {
  const Names names(rows);
  const std::string runs =
      fmt::format("{} run{} each, interleaved", repeats, repeats == 1 ? "" : "s");
  for (std::size_t first = 0; first < rows.size();) {
    const std::string file = rows[first].file;
    Table table(
        names.header({"received", "lost", "dropped", "late", "too_late", "misses", "p50", "p90",
                      "p99", "p99.9", "max", "timer_p99", "cpu_%", "wakeups/s", "pss_MB"}));
    // Sort by chain, so that compared rows are next to each other.
    std::map<std::string, std::vector<std::vector<std::string>>> by_chain;
    for (; first < rows.size() && rows[first].file == file; ++first) {
      const Comparison& row = rows[first];
      std::vector<std::string> cells;
      for (const std::optional<std::uint64_t> count :
           {std::optional(row.received), std::optional(row.lost), std::optional(row.dropped),
            row.late, row.too_late, std::optional(row.deadline_misses)}) {
        cells.push_back(count ? std::to_string(*count) : "-");
      }
      for (std::string& cell : percentiles(row.latency)) cells.push_back(std::move(cell));
      cells.push_back(percentile(row.timer_latency, 0.99));
      cells.push_back(fmt::format("{:.2f}", rt::median(row.cpu_percent)));
      cells.push_back(fmt::format("{:.0f}", rt::median(row.wakeups_per_s)));
      cells.push_back(fmt::format("{:.1f}", rt::median(row.pss_mb)));
      table.add(names.row(row, cells));
      for (const auto& [name, chain] : row.chains) {
        std::vector<std::string> chain_cells{name, std::to_string(chain.instances),
                                             std::to_string(chain.misses),
                                             std::to_string(chain.aborted)};
        for (std::string& cell : percentiles(chain.latency)) chain_cells.push_back(std::move(cell));
        by_chain[name].push_back(names.row(row, chain_cells));
      }
    }
    table.print(
        fmt::format("{} ({}; latency of subscriptions in µs, publish → callback)", file, runs));
    Table chains(names.header(
        {"chain", "instances", "misses", "aborted", "p50", "p90", "p99", "p99.9", "max"}));
    for (auto& [name, chain_rows] : by_chain) {
      for (auto& row : chain_rows) chains.add(std::move(row));
    }
    chains.print(fmt::format("{} ({}; chains, release of the first callback → end of the last, µs)",
                             file, runs));
  }
}

std::vector<std::string> words_of(const Comparison& row, const Options& options) {
  std::vector<std::string> words{"run", row.file,       "--duration",    options.duration, "--json",
                                 "-",   "--histograms", "--composition", row.composition};
  if (row.executor != kFile) words.insert(words.end(), {"--executor", row.executor});
  if (!row.scheduler.empty() && row.scheduler != kFile) {
    words.insert(words.end(), {"--scheduler", row.scheduler});
  }
  return words;
}

/// Runs all rows in turn for each repeat. Returns the runs, and the reason if some are missing
/// (empty otherwise).
std::pair<json, std::string> measure(std::vector<Comparison>& rows, const Options& options) {
  const EndSignals signals;
  json runs = json::array();
  const std::size_t total = rows.size() * static_cast<std::size_t>(options.repeat);
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  std::string interrupted;
  try {
    for (int repeat = 0; repeat < options.repeat; ++repeat) {
      for (Comparison& row : rows) {
        if (shows_progress) {
          rt::clear_line();
          rt::to_stderr("{} of {}: {} {}", runs.size() + 1, total, row.executor,
                        fmt::format("{} {}", row.scheduler, row.composition));
        }
        json run = run_again(words_of(row, options), signals).at("runs").at(0);
        run["repeat"] = repeat;
        add_run(row, run);
        runs.push_back(std::move(run));
      }
    }
  } catch (const Interrupted& interruption) {
    interrupted =
        fmt::format("{} when {} of {} runs were complete", interruption.what(), runs.size(), total);
  }
  if (shows_progress) rt::clear_line();
  signals.let_through();
  std::erase_if(rows, [](const Comparison& row) { return row.cpu_percent.empty(); });
  return {std::move(runs), interrupted};
}

void compare(const Options& options) {
  for (const std::string& file : options.files) read_system(file);  // may load executors
  const std::vector<std::string> executor_names = selection(options.executors, executors());
  const std::vector<std::string> scheduler_names =
      options.schedulers.empty() ? std::vector<std::string>{""}
                                 : selection(options.schedulers, schedulers());
  const std::vector<std::string> composition_names =
      options.compositions == "all" ? std::vector<std::string>{"single", "per-node"}
                                    : CLI::detail::split(options.compositions, ',');
  for (const std::string& name : composition_names) {
    const std::vector<std::string> valid{"file", "single", "per-node"};
    if (std::find(valid.begin(), valid.end(), name) == valid.end()) {
      throw Error(fmt::format("there is no composition '{}'", name), suggest(name, valid));
    }
  }
  parse_run_time(options.duration);
  check_writable(options.json);
  if (!options.report.empty()) check_report(options.report);
  std::vector<Comparison> rows;
  for (const std::string& file : options.files) {
    for (const std::string& executor : executor_names) {
      for (const std::string& scheduler : scheduler_names) {
        for (const std::string& composition : composition_names) {
          rows.push_back({.file = file,
                          .executor = executor,
                          .scheduler = scheduler,
                          .composition = composition});
        }
      }
    }
  }
  auto [runs, interrupted] = measure(rows, options);
  if (runs.empty()) throw std::runtime_error(interrupted);
  if (options.json != "-") print(rows, options.repeat);
  const json document = result_document(std::move(runs));
  if (!options.json.empty()) write_json(document, options.json);
  if (!options.report.empty()) write_report(document, options.report);
  if (!interrupted.empty()) throw std::runtime_error(interrupted);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->files, "Configuration files or iRobot JSON workloads")
      ->required();
  command->add_option("--executors", options->executors,
                      "all, or a list: events,single_threaded; file: as in the file");
  command->add_option("--schedulers", options->schedulers,
                      "all, or a list (default: that of each executor)");
  command->add_option("--compositions", options->compositions,
                      "file, single, per-node, or a list; all: single,per-node");
  command->add_option("--duration", options->duration, "Duration of each run (5s)");
  command->add_option("--repeat", options->repeat, "Runs of each row")->check(CLI::Range(1, 1000));
  command->add_option("--report", options->report, "Also write an HTML page");
  command->add_option("--json", options->json, "Also write every run as JSON; - for stdout");
  command->footer(
      "Example:\n  takt compare robot.yaml --executors all --duration 5s --repeat 3 "
      "--report robot.html\n");
  command->callback([options] { compare(*options); });
}
const Command registered("compare",
                         "Runs a system under several executors, interleaved, and prints one table",
                         set_up);

}  // namespace
}  // namespace takt::tools::compare_command
