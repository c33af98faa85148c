// takt compare: runs a system under several executors and schedulers, and prints one table.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "report.hpp"
#include "run/comparison.hpp"
#include "run/live_line.hpp"
#include "run/result_files.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "run/verdicts.hpp"
#include "table.hpp"

namespace takt::tools::compare_command {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string executors = "all", placement = "file", schedulers, compositions = "file",
              duration = "5s", against, save, report;
  ResultFiles results;
  int repeat = 1;
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

/// The cells that identify a row.
class Names {
 public:
  explicit Names(std::span<const Comparison> rows)
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

std::string other_names(const Comparison& row) {
  std::string text;
  if (row.placement != kFile) text += " " + row.placement;
  if (!row.scheduler.empty()) text += " " + row.scheduler;
  if (row.composition != kFile) text += " " + row.composition;
  return text;
}

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

/// Counts of runs of different lengths can only be compared by the second.
std::string per_second(std::uint64_t count, const Comparison& row) {
  return row.seconds == 0 ? "-" : fmt::format("{:.1f}", static_cast<double>(count) / row.seconds);
}

std::vector<std::string> cells_of(const Comparison& row) {
  std::vector<std::string> cells{
      row.setup.threads_text(), fmt::format("{:.2f}{}", row.seconds, row.is_long ? "!" : ""),
      std::to_string(row.totals.messages.received), per_second(row.totals.messages.received, row)};
  for (const std::optional<std::uint64_t> count :
       {std::optional(row.totals.lost), std::optional(row.totals.messages.dropped),
        std::optional(row.totals.overruns), row.totals.messages.late, row.totals.messages.too_late,
        std::optional(row.totals.messages.deadline_misses)}) {
    cells.push_back(count ? std::to_string(*count) : "-");
  }
  for (std::string& cell : percentiles(row.totals.latency)) cells.push_back(std::move(cell));
  cells.push_back(percentile(row.totals.timer_latency, 0.99));
  cells.push_back(fmt::format("{:.2f}", rt::median(row.cpu_percent)));
  cells.push_back(fmt::format("{:.0f}", rt::median(row.wakeups_per_s)));
  cells.push_back(fmt::format("{:.1f}", rt::median(row.pss_mb)));
  return cells;
}

/// An executor that skips releases looks good otherwise: what never ran was never late.
std::string served_text(std::span<const Comparison> rows) {
  std::string text;
  for (const Comparison& row : rows) {
    if (row.releases.due == 0) continue;
    // Rounded down: 100 % are all.
    const std::uint64_t tenths = row.releases.served * 1000 / row.releases.due;
    text += fmt::format("{}{}{} {}.{} % ({} of {})", text.empty() ? "" : ", ", row.executor,
                        other_names(row), tenths / 10, tenths % 10, row.releases.served,
                        row.releases.due);
  }
  return text.empty() ? "" : fmt::format("releases of timers that were served: {}\n", text);
}

/// What else than its word a row differs in.
void print_differences(std::span<const Comparison> rows) {
  std::vector<std::pair<std::string, Setup>> setups;
  for (const Comparison& row : rows)
    setups.emplace_back(row.executor + other_names(row), row.setup);
  for (const std::string& line : differences(setups)) rt::print("rows differ in {}\n", line);
}

/// Rows of one file.
void print(std::span<const Comparison> rows, const std::string& runs) {
  const std::string title = with_program(rows.front().file);
  const Names names(rows);
  Table table(names.header({"threads", "seconds", "received", "received/s", "lost", "dropped",
                            "overruns", "late", "too_late", "misses", "p50", "p90", "p99", "p99.9",
                            "max", "timer_p99", "cpu_%", "wakeups/s", "pss_MB"}));
  // Sort by chain, so that compared rows are next to each other.
  std::map<std::string, std::vector<std::vector<std::string>>> by_chain;
  for (const Comparison& row : rows) {
    table.add(names.row(row, cells_of(row)));
    for (const auto& [name, chain] : row.totals.chains) {
      std::vector<std::string> cells{name,
                                     fmt::format("{:.2f}", row.seconds),
                                     std::to_string(chain.instances),
                                     per_second(chain.instances, row),
                                     std::to_string(chain.misses),
                                     std::to_string(chain.aborted)};
      for (std::string& cell : percentiles(chain.latency)) cells.push_back(std::move(cell));
      by_chain[name].push_back(names.row(row, cells));
    }
  }
  print_differences(rows);
  table.print(
      fmt::format("{} ({}; latency of subscriptions in µs, publish → callback)", title, runs));
  rt::print("{}", served_text(rows));
  if (std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.is_long; })) {
    rt::print("! a run took longer than asked: compare its counts by the second\n");
  }
  Table chains(names.header({"chain", "seconds", "instances", "instances/s", "misses", "aborted",
                             "p50", "p90", "p99", "p99.9", "max"}));
  for (auto& [name, chain_rows] : by_chain) {
    for (auto& row : chain_rows) chains.add(std::move(row));
  }
  chains.print(fmt::format("{} ({}; chains, release of the first callback → end of the last, µs)",
                           title, runs));
}

/// "20 runs each", or after an interruption how many there were: "3 to 4 of 20 runs each".
std::string runs_text(std::span<const Comparison> rows, int repeats) {
  const auto [least, most] =
      std::minmax_element(rows.begin(), rows.end(), [](const auto& row, const auto& other) {
        return row.cpu_percent.size() < other.cpu_percent.size();
      });
  const std::size_t from = least->cpu_percent.size(), to = most->cpu_percent.size();
  std::string complete;
  if (from != to) complete = fmt::format("{} to {} of ", from, to);
  if (from == to && std::cmp_less(to, repeats)) complete = fmt::format("{} of ", to);
  return fmt::format("{}{} run{} each, interleaved", complete, repeats, repeats == 1 ? "" : "s");
}

void print(std::span<const Comparison> rows, int repeats) {
  const std::string runs = runs_text(rows, repeats);
  while (!rows.empty()) {
    const auto end = std::find_if(rows.begin(), rows.end(),
                                  [&](const auto& row) { return row.file != rows.front().file; });
    const auto count = static_cast<std::size_t>(end - rows.begin());
    print(rows.first(count), runs);
    rows = rows.subspan(count);
  }
}

std::vector<std::string> words_of(const Comparison& row, const Options& options) {
  std::vector<std::string> words{"run"};
  if (!row.file.empty()) words.push_back(row.file);
  words.insert(words.end(), {"--duration", options.duration, "--json", "-", "--histograms"});
  if (row.composition != kFile) words.insert(words.end(), {"--composition", row.composition});
  if (row.executor != kFile) {
    words.insert(words.end(), {"--executor", row.executor, "--placement", row.placement});
  }
  if (!row.scheduler.empty() && row.scheduler != kFile) {
    words.insert(words.end(), {"--scheduler", row.scheduler});
  }
  const std::vector<std::string>& program = program_words();
  if (!program.empty()) {
    words.push_back("--");
    words.insert(words.end(), program.begin(), program.end());
  }
  return words;
}

/// "events", "events edf", "events per-node".
std::string what_differs(const Comparison& row) {
  std::string text = row.executor;
  for (const std::string& part : {row.placement, row.scheduler, row.composition}) {
    if (!part.empty() && part != "file") text += " " + part;
  }
  return text;
}

/// Runs all rows in turn for each repeat. Returns the runs, and why some are missing, if so.
std::pair<std::vector<rt::Run>, std::optional<Interrupted>> measure(std::vector<Comparison>& rows,
                                                                    const Options& options) {
  const EndSignals signals;
  std::vector<rt::Run> runs;
  const std::size_t total = rows.size() * static_cast<std::size_t>(options.repeat);
  const Nanoseconds asked = parse_run_time(options.duration);
  std::optional<Interrupted> interrupted;
  try {
    LiveLine line("comparing");
    for (int repeat = 0; repeat < options.repeat; ++repeat) {
      for (Comparison& row : rows) {
        line.step(what_differs(row), runs.size(), total, asked);
        rt::Run run = run_once(words_of(row, options), signals, !program_words().empty());
        run.repeat = static_cast<std::uint64_t>(repeat);
        add_run(row, run, asked);
        runs.push_back(std::move(run));
      }
    }
  } catch (const Interrupted& interruption) {
    interrupted.emplace(interruption.signal,
                        fmt::format(" when {} of {} runs were complete", runs.size(), total));
  }
  std::erase_if(rows, [](const Comparison& row) { return row.cpu_percent.empty(); });
  return {std::move(runs), interrupted};
}

/// Rows of the same name would be taken for one.
void refuse_twins(const char* option, const std::vector<std::string>& names) {
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) == name) continue;
    throw Error(fmt::format("{}: '{}' is given twice", option, *name),
                "name each once; --repeat makes more runs");
  }
}

/// What is asked for, or Error before anything is measured.
std::vector<Comparison> rows_of(Options& options) {
  for (const std::string& file : options.files) read_system(file);  // may load executors
  if (options.files.empty()) {
    if (program_words().empty()) {
      throw Error("nothing to compare", "give a FILE, or a program after --");
    }
    options.files = {""};  // the program alone
  }
  if (!program_words().empty() && options.compositions != kFile) {
    throw Error("--compositions is for containers, not for a program", "leave it out");
  }
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
  refuse_twins("FILE", options.files);
  refuse_twins("--executors", executor_names);
  refuse_twins("--schedulers", scheduler_names);
  refuse_twins("--compositions", composition_names);
  std::vector<Comparison> rows;
  for (const std::string& file : options.files) {
    for (const std::string& executor : executor_names) {
      for (const std::string& scheduler : scheduler_names) {
        for (const std::string& composition : composition_names) {
          rows.push_back({.file = file,
                          .executor = executor,
                          .placement = executor == kFile ? std::string(kFile) : options.placement,
                          .scheduler = scheduler,
                          .composition = composition});
        }
      }
    }
  }
  return rows;
}

/// Refuses before the measurement what could not be written after it.
void check_outputs(const Options& options) {
  options.results.check();
  if (!options.save.empty()) {
    const std::vector<std::string> names = executors().names();
    if (std::find(names.begin(), names.end(), options.save) != names.end()) {
      throw Error(fmt::format("--save: '{}' is an executor, which --against would find first",
                              options.save),
                  "choose another name");
    }
  }
  if (!options.report.empty()) check_report(options.report);
}

Against find_against(const Options& options, std::span<const Comparison> rows) {
  std::vector<RowName> names;
  for (const Comparison& row : rows) {
    names.push_back({with_program(row.file), row.executor, row.placement,
                     row.scheduler.empty() ? std::string(kFile) : row.scheduler, row.composition});
  }
  return find_against(options.against, names);
}

/// Of files that are watched (`analysis: {watch: true}`).
void note_deviations(std::span<const rt::Run> runs) {
  std::map<std::string, std::set<std::string>> found;  // ids by row
  for (const rt::Run& run : runs) {
    if (!run.deviations) continue;
    for (const auto& deviation : *run.deviations) {
      found[fmt::format("{}, executor {}", run.file, run.executor)].insert(deviation.id);
    }
  }
  for (const auto& [row, ids] : found) {
    rt::to_stderr("note: {}: runs deviated from what its bounds rest on: {}\n", row,
                  fmt::join(ids, ", "));
  }
}

void compare(Options options) {
  std::vector<Comparison> rows = rows_of(options);
  parse_run_time(options.duration);
  const Against against = find_against(options, rows);
  const bool is_comparison = rows.size() > options.files.size() || against.stored.has_value();
  check_outputs(options);
  begin_work();
  auto [runs, interrupted] = measure(rows, options);
  if (runs.empty()) throw Interrupted(*interrupted);
  const std::vector<Compared> compared = compare_rows(runs, against);
  for (const std::string& note : stored_notes(runs, against)) rt::to_stderr("note: {}\n", note);
  note_deviations(runs);
  if (!options.results.use_stdout()) {
    print(rows, options.repeat);
    if (is_comparison) print_verdicts(compared, against);
  }
  nlohmann::json document = rt::result_document(runs);
  document["bucket_limits_us"] = rt::bucket_limits_us();
  document["ratios"] = ratios_json(compared);
  options.results.write(document, runs, true, compared);
  if (!interrupted && !options.save.empty()) write_json(document, stored_path(options.save));
  const bool has_nodes = program_words().empty();  // a program's are not known here
  if (!options.report.empty()) {
    document["sentences"] = sentences_json(compared);
    write_report(document, options.report, has_nodes ? options.files : std::vector<std::string>());
  }
  if (interrupted) throw Interrupted(*interrupted);
}

/// A name, or the path of a file: "" was taken for no option, and ".." made "...compared.json".
CLI::Option* stored_name(CLI::Option* option) {
  return option->check(CLI::Validator(
      [](const std::string& text) {
        const std::string name = std::filesystem::path(text).filename();
        if (!name.empty() && name != "." && name != ".." && name != ".json") return std::string();
        return fmt::format("'{}' is no name; write one such as before, or results/before", text);
      },
      ""));
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->files, "Configuration files or iRobot JSON workloads");
  command->add_option(
      "--executors", options->executors,
      "all, or a list: events,single_threaded; file: as in the file (see: takt list "
      "executors)");
  placement_option(command, options->placement);
  command->add_option("--schedulers", options->schedulers,
                      "all, or a list (default: that of each executor; see: takt list schedulers)");
  command->add_option("--compositions", options->compositions,
                      "file, single, per-node, or a list; all: single,per-node");
  time_text(
      command->add_option("--duration", options->duration, "Duration of each run (default: 5s)"));
  whole_number(command->add_option("--repeat", options->repeat,
                                   "Runs of each row; six are the least that tell a difference "
                                   "from chance (default: 1)"),
               1, 1000);
  stored_name(command->add_option(
      "--against", options->against,
      "What the ratios are to: an executor of this comparison, or runs stored by --save "
      "(default: the first executor)"));
  stored_name(add_output(
      *command, "--save", options->save,
      "Store the runs for --against, as NAME.compared.json in this folder",
      [](const std::string& name) { return named_file(name.empty() ? name : stored_path(name)); }));
  add_output(*command, "--report", options->report, "Also write an HTML page");
  options->results.add_options(command, "every run");
  command->footer(
      "With -- PROGRAM [ARGUMENT]... runs a program written for rclcpp, each FILE as its "
      "TAKT_CONFIG.\n\n"
      "Example:\n  takt compare robot.yaml --executors all --duration 5s --repeat 10 "
      "--report robot.html\n  takt compare robot.yaml --executors file --repeat 10 --save before\n"
      "  takt compare robot.yaml --executors file --repeat 10 --against before\n  takt compare "
      "--executors events,file -- takt ros2 run my_package "
      "my_program\n");
  command->callback([options] { compare(*options); });
}
const Command registered("compare",
                         "Runs a system under several executors, interleaved, and prints one table",
                         set_up, Command::Takes::program);

}  // namespace
}  // namespace takt::tools::compare_command
