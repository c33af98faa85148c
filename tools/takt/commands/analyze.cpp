// takt analyze: upper bounds of the response times of a system.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/base/time.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run.hpp"

#include "analyze/analyzed_file.hpp"
#include "analyze/sweep.hpp"
#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "report.hpp"
#include "rta/json_lines.hpp"
#include "run/live_line.hpp"
#include "run/program.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::analyze_command {
namespace {

using nlohmann::json;

struct Options {
  std::string file, explained, sweep, report, json, suggest, overheads, placement = "file";
  bool allows_unbounded = false, lines = false;
  AnalyzeOptions how;
};

/// How long changes that would help are looked for; zero: not at all.
Nanoseconds time_for_suggestions(const Options& options) {
  if (options.suggest == "off" || (options.suggest.empty() && !options.json.empty())) return {};
  return options.suggest.empty() ? std::chrono::seconds(2) : parse_run_time(options.suggest);
}

std::string ms(const std::optional<Nanoseconds>& bound) {
  return bound ? milliseconds(*bound) + " ms" : "no bound";
}

json print_suggestions(const AnalyzedFile& file, Nanoseconds most, bool prints) {
  if (most == Nanoseconds::zero()) return {};
  json result = json::array();
  const auto [found, tried, is_complete] = [&] {
    const LiveLine line("looking for what would help");
    return suggestions(file, most);
  }();
  if (prints && (tried != 0 || !is_complete)) {
    rt::print("\nwhat would help ({} changes tried{})\n", tried,
              is_complete ? "" : ", not all: `--suggest TIME` gives it more time");
    if (found.empty()) rt::print("  none of them\n");
  }
  for (const Suggestion& suggestion : found) {
    if (prints) {
      rt::print("  {}  ({}: {} → {})\n", suggestion.change, suggestion.chain, ms(suggestion.before),
                ms(suggestion.after));
    }
    const auto us = [](const auto& bound) { return bound ? json(rt::us(*bound)) : json(); };
    result.push_back({{"change", suggestion.change},
                      {"chain", suggestion.chain},
                      {"before_us", us(suggestion.before)},
                      {"after_us", us(suggestion.after)}});
  }
  return result;
}

// Thousands of systems are a study: who else runs here is not looked up for each.
void analyze_lines(AnalyzeOptions how) {
  how.machine = facts_of_kernel();
  const auto answer = [&](document::Value& value, document::Errors& errors, json& result) {
    SystemDescription system = read_configuration(value, errors);
    errors.throw_if_any();
    system.file = errors.file();
    result.update(bounds_json(analyze_system(std::move(system), how)));
  };
  answer_lines("systems", answer);
}

void run(Options options) {
  options.how.overrides.placement = parse_placement(options.placement);
  options.how.measures_overheads = !options.overheads.empty();
  if (options.lines) return analyze_lines(options.how);
  if (options.file.empty()) throw CLI::RequiredError("FILE");
  note_variables(options.how.overrides.executor, options.placement,
                 options.how.overrides.scheduler);
  if (!options.report.empty()) check_report(options.report);
  options.how.draws_schedule = !options.report.empty();
  if (!program_words().empty()) {
    if (!options.how.as.empty())
      throw Error("--as is for containers, not for a program", "leave one of them out");
    read_system(options.file, options.how.settings);  // its errors are not the program's
    options.how.nodes = nodes_of_program(program_words(), options.file);
  }
  const bool prints = options.json != "-";
  json swept;  // before the file itself is analysed: nodes of one name must not exist twice
  if (!options.sweep.empty()) swept = sweep(options.file, options.how, options.sweep, prints);
  const Nanoseconds most = time_for_suggestions(options);
  const AnalyzedFile file = [&] {
    const LiveLine line("analysing");
    return analyze_file(options.file, options.how);
  }();
  for (const std::string& note : file.system.notes) rt::to_stderr("note: {}\n", note);
  const bool is_interrupted = file.simulated && file.simulated->signal != 0;
  json document = analysis_json(file);
  if (!options.explained.empty()) {
    print_explanation(file, options.explained);
  } else if (!swept.is_null()) {
    document["sweep"] = std::move(swept);
  } else {
    if (prints) print_analysis(file);
    document["suggestions"] =
        print_suggestions(file, is_interrupted ? Nanoseconds::zero() : most, prints);
  }
  if (!options.report.empty()) {
    json page = rt::result_document({});
    page["analyses"] = json::array({document});
    if (file.simulated && !file.simulated->worst_schedule.is_null())
      page["analyses"][0]["worst_schedule"] = file.simulated->worst_schedule;
    const bool has_nodes = program_words().empty();  // a program's are not known here
    write_report(page, options.report,
                 has_nodes ? std::vector{options.file} : std::vector<std::string>());
  }
  if (!options.json.empty()) write_json(document, options.json);
  if (is_interrupted) {
    throw Interrupted(file.simulated->signal,
                      fmt::format(" when {} of {} simulated runs were complete",
                                  file.simulated->runs, options.how.simulated_runs));
  }
  const bool passes = options.allows_unbounded ? !file.is_contradicted() : file.is_all_guaranteed();
  if (!passes) throw CLI::RuntimeError(kFailed);
}

/// Instead of all that is about one file.
void add_lines(CLI::App& command, Options& options) {
  auto* const lines = command.add_flag(
      "--lines", options.lines,
      "Each line of stdin is a file as JSON, also with an id; a line of JSON for each");
  for (const char* of_one : {"FILE", "--model", "--overheads", "--explain", "--sweep", "--suggest",
                             "--allow-unbounded", "--simulate", "--report", "--json"}) {
    lines->excludes(command.get_option(of_one));
  }
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option(
      "FILE", options->file,
      "A configuration file (needed without --lines); its components are constructed, but do not "
      "run");
  command->add_option("--model", options->how.model,
                      "A file of `takt model`, with measured execution times and arrivals");
  command
      ->add_option("--executor", options->how.overrides.executor,
                   "As for `takt run`: makes each executor of the file one of this type (see: "
                   "takt list executors)")
      ->envname("TAKT_EXECUTOR");
  placement_option(command, options->placement)->envname("TAKT_PLACEMENT");
  command
      ->add_option("--scheduler", options->how.overrides.scheduler,
                   "As for `takt run` (see: takt list schedulers)")
      ->envname("TAKT_SCHEDULER");
  as_option(*command, options->how.as);
  command
      ->add_option("--overheads", options->overheads,
                   "`measure`: measures in two seconds what Linux and Takt need on this machine, "
                   "instead of `machine: overheads`")
      ->check(CLI::IsMember({"measure"}));
  command->add_option("--explain", options->explained,
                      "Shows how the bound of this chain comes about");
  command->add_option("--sweep", options->sweep,
                      "KEY=A..B: the bounds for ten values of a key of the file");
  time_text(command->add_option("--suggest", options->suggest,
                                "How long to look for changes that would help (default: 2s, and "
                                "off with --json)"),
            "off");
  command->add_flag("--allow-unbounded", options->allows_unbounded,
                    "Exit 0 unless a run has missed a deadline, or taken longer than its bound");
  auto* const simulated = whole_number(
      command->add_option("--simulate", options->how.simulated_runs,
                          "Show the longest latencies of so many simulated runs, too, and how to "
                          "repeat one in which a chain is late"),
      1, 1'000'000);
  for (const char* other : {"--explain", "--sweep"})
    simulated->excludes(command->get_option(other));
  add_output(*command, "--report", options->report, "Also write an HTML page with a figure");
  add_output(*command, "--json", options->json, "Also write the results as JSON; - for stdout");
  add_lines(*command, *options);
  command->footer(
      "Exit 0: there are chains, and each has a deadline and meets it for sure: `guaranteed`.\n"
      "With -- PROGRAM [ARGUMENT]... FILE is the TAKT_CONFIG of a program written for rclcpp, "
      "which\n"
      "is started until it spins.\n"
      "Examples:\n"
      "  takt analyze robot.yaml\n"
      "  takt analyze robot.yaml --model robot.model.yaml --report robot.html\n"
      "  takt analyze robot.yaml --simulate 100\n"
      "  takt analyze robot.yaml --explain sense_to_act\n"
      "  takt analyze robot.yaml --sweep threads.control.runtime=1ms..9ms\n"
      "  takt analyze robot.yaml -- takt ros2 run my_package my_program\n"
      "  takt random --seed 1 --lines 1000 | takt analyze --lines > systems.jsonl\n");
  command->callback([options] { run(*options); });
}
const Command registered("analyze", "Bounds the latency of each chain of a file, and says why",
                         set_up, Command::Takes::program);

}  // namespace
}  // namespace takt::tools::analyze_command
