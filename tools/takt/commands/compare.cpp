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

#include "takt/base/time.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/run.hpp"

#include "bundle/bundle.hpp"
#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "report.hpp"
#include "run/comparison.hpp"
#include "run/comparison_tables.hpp"
#include "run/live_line.hpp"
#include "run/result_files.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "run/verdicts.hpp"

namespace takt::tools::compare_command {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string executors, as, placement = "file", schedulers, compositions = "file", duration = "5s",
                             against, save, report, figure, model, bundle;
  ResultFiles results;
  int repeat = 1;
  bool simulates = false;
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

std::vector<std::string> words_of(const Comparison& row, const Options& options) {
  std::vector<std::string> words{options.simulates ? "simulate" : "run"};
  if (!row.file.empty()) words.push_back(row.file);
  words.insert(words.end(), {"--duration", options.duration, "--json", "-", "--histograms"});
  if (options.simulates) words.insert(words.end(), {"--runs", std::to_string(options.repeat)});
  if (!options.model.empty()) words.insert(words.end(), {"--model", options.model});
  if (row.composition != kFile) words.insert(words.end(), {"--composition", row.composition});
  if (row.placement == kAs) {
    words.insert(words.end(), {"--as", row.executor});
  } else if (row.executor != kFile) {
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
    if (!part.empty() && part != "file" && part != kAs) text += " " + part;
  }
  return text;
}

/// Runs `function` for the row. One of `--as all` that cannot run the file is left out.
template <class Function>
void run_row(Comparison& row, const Options& options, Function&& function) {
  if (row.is_refused) return;
  try {
    function();
  } catch (const Refused&) {
    if (row.placement != kAs || options.as != "all") throw;
    row.is_refused = true;
    rt::to_stderr("note: left out: {} cannot run '{}', see above\n", what_differs(row), row.file);
  }
}

/// Runs all rows in turn for each repeat.
void run_in_turn(std::vector<Comparison>& rows, const Options& options, const EndSignals& signals,
                 std::vector<rt::Run>& runs) {
  const Nanoseconds asked = parse_run_time(options.duration);
  const std::size_t total = rows.size() * static_cast<std::size_t>(options.repeat);
  LiveLine line("comparing");
  for (int repeat = 0; repeat < options.repeat; ++repeat) {
    for (Comparison& row : rows) {
      line.step(what_differs(row), runs.size(), total, asked);
      run_row(row, options, [&] {
        rt::Run run = run_once(words_of(row, options), signals, !program_words().empty());
        run.repeat = static_cast<std::uint64_t>(repeat);
        add_run(row, run, asked);
        runs.push_back(std::move(run));
      });
    }
  }
}

/// All repeats of a row at once: what runs beside them does not matter.
void simulate(std::vector<Comparison>& rows, const Options& options, const EndSignals& signals,
              std::vector<rt::Run>& runs) {
  LiveLine line("simulating");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    line.step(what_differs(rows[i]), i, rows.size(), Nanoseconds::zero());
    run_row(rows[i], options, [&] {
      const nlohmann::json result = run_again(words_of(rows[i], options), signals, true);
      for (rt::Run& run : rt::read_runs(result, "")) {
        add_run(rows[i], run, parse_run_time(options.duration));
        runs.push_back(std::move(run));
      }
    });
  }
}

/// Returns the runs, and why some are missing, if so.
std::pair<std::vector<rt::Run>, std::optional<Interrupted>> measure(std::vector<Comparison>& rows,
                                                                    const Options& options) {
  const EndSignals signals;
  std::vector<rt::Run> runs;
  std::optional<Interrupted> interrupted;
  try {
    (options.simulates ? simulate : run_in_turn)(rows, options, signals, runs);
  } catch (const Interrupted& interruption) {
    interrupted.emplace(interruption.signal,
                        fmt::format(" when {} of {} runs were complete", runs.size(),
                                    rows.size() * static_cast<std::size_t>(options.repeat)));
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

/// Callbacks that interrupt each other need an order that says which; nobody has named this pair.
bool is_left_out(const std::string& executor, const std::string& scheduler) {
  if (scheduler.empty() || executor == kFile || scheduler == kFile) return false;
  if (!executors().traits(executor).takes_band) return false;
  ExecutorOptions options{.name = executor, .scheduler = scheduler, .realtime = Realtime::off};
  for (const int priority : {1, 2})
    options.threads.push_back(
        {.policy = ThreadPolicy::fifo, .priority = priority, .affinity = {0}});
  try {
    executors().make(executor, options);
  } catch (const Error& error) {
    rt::to_stderr("note: left out: {}\n", error.what());
    return true;
  }
  return false;
}

/// "all" that fit, or a list separated by commas of words of the catalogue and files.
std::vector<std::string> as_selection(const std::string& text) {
  std::vector<std::string> words;
  if (text != "all") {
    words = CLI::detail::split(text, ',');
    if (std::find(words.begin(), words.end(), "") != words.end())
      throw Error(fmt::format("--as '{}' has an empty entry", text), "remove a comma");
    return words;
  }
  for (const CatalogueEntry& entry : catalogue())
    if (entry.why_not.empty()) words.push_back(entry.word);
  return words;
}

/// Refuses options that do not go together.
void check(const Options& options) {
  const bool is_program = !program_words().empty();
  if (options.files.empty() && !is_program) {
    throw Error("nothing to compare", "give a FILE, or a program after --");
  }
  if (options.simulates && (is_program || options.compositions != kFile)) {
    throw Error("--simulate is for files as they are, not for programs or --compositions",
                "leave one of them out");
  }
  if (!options.simulates && !options.model.empty()) {
    throw Error("--model is for --simulate", "add that, or leave the model out");
  }
  if (is_program && !options.bundle.empty()) {
    throw Error("--bundle is for containers, not for a program, which may need any file",
                "leave it out");
  }
  if (is_program && (options.compositions != kFile || !options.as.empty())) {
    throw Error("--compositions and --as are for containers, not for a program", "leave them out");
  }
  const bool has_only_as = !options.as.empty() && options.executors.empty();
  if (has_only_as && (!options.schedulers.empty() || options.placement != kFile)) {
    throw Error("--schedulers and --placement are for --executors, and --as has its own",
                "leave them out, or name executors, too");
  }
}

std::vector<std::string> compositions_of(const Options& options) {
  if (options.compositions == "all") return {"single", "per-node"};
  std::vector<std::string> names = CLI::detail::split(options.compositions, ',');
  for (const std::string& name : names) {
    const std::vector<std::string> valid{"file", "single", "per-node"};
    if (std::find(valid.begin(), valid.end(), name) == valid.end()) {
      throw Error(fmt::format("there is no composition '{}'", name), suggest(name, valid));
    }
  }
  refuse_twins("--compositions", names);
  return names;
}

/// The rows of executors of Takt, with a scheduler each; then those of the catalogue. Each in each
/// composition; the first of them says for which file.
std::vector<Comparison> rows_of_one_file(const Options& options) {
  const std::vector<std::string> executor_names =
      options.executors.empty() && !options.as.empty()
          ? std::vector<std::string>()
          : selection(options.executors.empty() ? "all" : options.executors, executors());
  const std::vector<std::string> scheduler_names =
      options.schedulers.empty() ? std::vector<std::string>{""}
                                 : selection(options.schedulers, schedulers());
  refuse_twins("--executors", executor_names);
  refuse_twins("--schedulers", scheduler_names);
  const bool is_named =
      options.executors != "all" && !options.executors.empty() && options.schedulers != "all";
  std::vector<Comparison> rows;
  for (const std::string& executor : executor_names) {
    for (const std::string& scheduler : scheduler_names) {
      if (!is_named && is_left_out(executor, scheduler)) continue;
      rows.push_back({.executor = executor,
                      .placement = executor == kFile ? std::string(kFile) : options.placement,
                      .scheduler = scheduler});
    }
  }
  if (options.as.empty()) return rows;
  const std::vector<std::string> as_names = as_selection(options.as);
  refuse_twins("--as", as_names);
  for (const std::string& as : as_names) {
    if (std::find(executor_names.begin(), executor_names.end(), as) == executor_names.end())
      continue;
    throw Error(fmt::format("--executors and --as both name '{}'", as),
                "leave one of them out: rows of one name cannot be told apart");
  }
  for (const std::string& as : as_names) rows.push_back({.executor = as, .placement = kAs});
  return rows;
}

/// What is asked for, or Error before anything is measured.
std::vector<Comparison> rows_of(Options& options) {
  check(options);
  for (const std::string& file : options.files) read_system(file);  // may load executors
  if (options.files.empty()) options.files = {""};                  // the program alone
  refuse_twins("FILE", options.files);
  const std::vector<std::string> compositions = compositions_of(options);
  const std::vector<Comparison> of_one_file = rows_of_one_file(options);
  std::vector<Comparison> rows;
  for (const std::string& file : options.files) {
    for (Comparison row : of_one_file) {
      if (row.placement == kAs) read_system_as(file, row.executor);  // its errors
      row.file = file;
      for (const std::string& composition : compositions) {
        row.composition = composition;
        rows.push_back(row);
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
  if (!options.figure.empty()) check_figure(options.figure);
  if (!options.bundle.empty() && !options.bundle.ends_with(kBundleEnding)) {
    throw Error(fmt::format("'{}' is no name of a bundle", options.bundle),
                fmt::format("end it with {}", kBundleEnding));
  }
  if (!options.bundle.empty()) check_bundled_name(folder_of_bundle(options.bundle));
}

/// What the runs of a bundle are stored as, for --against.
constexpr const char* kBefore = "before";

/// A word of --as there.
std::string bundled_as(const std::string& word) {
  if (!is_file(word)) return word;
  return (is_file(bundled(word)) ? "" : "./") + bundled(word);
}

/// The files of a bundle but the results: as they are before the measurement.
std::vector<BundledFile> bundled_files(const Options& options) {
  std::vector<std::string> words{"compare"}, systems = options.files;
  std::transform(systems.begin(), systems.end(), std::back_inserter(words), bundled);
  std::vector<std::string> as;
  for (const std::string& word : CLI::detail::split(options.as, ',')) {
    if (is_file(word)) systems.push_back(word);
    as.push_back(bundled_as(word));
  }
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  add("--executors", options.executors);
  add("--as", fmt::format("{}", fmt::join(as, ",")));
  if (options.placement != kFile) add("--placement", options.placement);
  add("--schedulers", options.schedulers);
  if (options.compositions != kFile) add("--compositions", options.compositions);
  add("--duration", options.duration);
  add("--repeat", std::to_string(options.repeat));
  if (options.simulates) words.push_back("--simulate");
  if (!options.model.empty()) add("--model", bundled(options.model));
  add("--against", kBefore);
  std::vector<BundledFile> files = files_of_systems(systems, options.model);
  files.push_back({kRunScript, run_script(words)});
  return files;
}

void write_bundle(const std::string& path, std::vector<BundledFile> files,
                  std::vector<rt::Run> runs, nlohmann::json document) {
  for (rt::Run& run : runs) {
    run.file = bundled(run.file);
    if (run.placement == kAs) run.executor = bundled_as(run.executor);
  }
  document["runs"] = rt::result_document(runs)["runs"];
  document.erase("ratios");  // they have the names of before
  files.push_back({kResults, rt::json_text(document)});
  write_bundle(path, std::move(files));
  rt::to_stderr("bundle: {}\n", path);
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
  std::vector<BundledFile> files;
  if (!options.bundle.empty()) files = bundled_files(options);
  begin_work();
  auto [runs, interrupted] = measure(rows, options);
  if (runs.empty() && interrupted) throw Interrupted(*interrupted);
  if (runs.empty()) throw Error("none of these can run the file", "see their messages above");
  const std::vector<Compared> compared = compare_rows(runs, against);
  for (const std::string& note : stored_notes(runs, against)) rt::to_stderr("note: {}\n", note);
  note_deviations(runs);
  if (!options.results.use_stdout()) {
    print_comparison(rows, options.repeat, options.simulates);
    if (is_comparison) print_verdicts(compared, against);
  }
  nlohmann::json document = rt::result_document(runs);
  document["bucket_limits_us"] = rt::bucket_limits_us();
  document["ratios"] = ratios_json(compared);
  if (options.simulates) document["simulated"] = true;
  options.results.write(document, runs, true, compared);
  if (!interrupted && !options.save.empty()) write_json(document, stored_path(options.save));
  if (!interrupted && !options.bundle.empty())
    write_bundle(options.bundle, std::move(files), runs, document);
  const bool has_nodes = program_words().empty();  // a program's are not known here
  if (!options.report.empty()) {
    document["sentences"] = sentences_json(compared);
    write_report(document, options.report, has_nodes ? options.files : std::vector<std::string>());
  }
  if (!options.figure.empty()) write_figure(document, options.figure);
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
      "executors) (default: all, with --as none)");
  placement_option(command, options->placement);
  command->add_option("--as", options->as,
                      "As for `takt run`: all, or a list: picas,cie,./own.yaml (see: takt list "
                      "catalogue)");
  command->add_option("--schedulers", options->schedulers,
                      "all, or a list (default: that of each executor; see: takt list schedulers)");
  command->add_option("--compositions", options->compositions,
                      "file, single, per-node, or a list; all: single,per-node");
  time_text(
      command->add_option("--duration", options->duration, "Duration of each run (default: 5s)"));
  command->add_flag("--simulate", options->simulates,
                    "As `takt simulate`, in virtual time and on the CPUs of the file: nothing of "
                    "this machine counts, and each repeat is another scenario");
  command->add_option("--model", options->model,
                      "With --simulate: a file of `takt model`, with measured execution times");
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
  add_output(*command, "--figure", options->figure,
             "Also write the latencies as OUT.pdf, one column of a paper wide, and as OUT.csv",
             [](const std::string& path) {
               return path.empty() ? named_file(path)
                                   : std::vector<std::string>{path, data_of_figure(path)};
             });
  add_output(*command, "--bundle", options->bundle,
             "Also write all that another machine needs to repeat this, as OUT.tar.zst; see `takt "
             "bundle`");
  options->results.add_options(command, "every run");
  command->footer(
      "With -- PROGRAM [ARGUMENT]... runs a program written for rclcpp, each FILE as its "
      "TAKT_CONFIG.\n\n"
      "Example:\n  takt compare robot.yaml --executors all --duration 5s --repeat 10 "
      "--report robot.html\n  takt compare robot.yaml --executors file --repeat 10 --save before\n"
      "  takt compare robot.yaml --executors file --repeat 10 --against before\n"
      "  takt compare robot.yaml --as all --executors file --simulate\n  takt compare "
      "--executors events,file -- takt ros2 run my_package "
      "my_program\n");
  command->callback([options] { compare(*options); });
}
const Command registered("compare",
                         "Runs a system under several executors, interleaved, and prints one table",
                         set_up, Command::Takes::program);

}  // namespace
}  // namespace takt::tools::compare_command
