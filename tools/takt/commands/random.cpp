// takt random: random systems and task sets, for comparisons and for tests of analyses.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/analysis/textbook/textbook.hpp"
#include "takt/base/available_cpus.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/version.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/sched/scheduler.hpp"

#include "commands.hpp"
#include "latency/cpu_set.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "random/random_system.hpp"
#include "random/task_sets.hpp"
#include "run/result_json.hpp"
#include "yaml_file.hpp"

namespace takt::tools::random_command {
namespace {

constexpr std::size_t kUsualCpus = 3;

void write(const RandomOptions& options, const std::string& path) {
  // With all that has been chosen, so that the command gives the same file elsewhere.
  const std::string text = fmt::format(
      "# Written by takt random --seed {} --executors {} --schedulers {} --cpus {} (Takt {})\n{}",
      options.seed, fmt::join(options.executors, ","), fmt::join(options.schedulers, ","),
      fmt::join(options.cpus, ","), TAKT_VERSION, yaml_file(random_system(options).document));
  if (path.empty()) {
    rt::print("{}", text);
    return;
  }
  write_output(path, text);
}

/// So many systems, each a line of JSON; the seed is its id.
void write_lines(RandomOptions options, std::size_t count) {
  for (; count > 0; --count, ++options.seed) {
    const RandomSystem system = random_system(options);
    nlohmann::ordered_json line{{"id", options.seed}, {"utilisation", system.utilisation}};
    line.update(system.document);
    rt::print("{}\n", rt::json_text(line));
  }
}

void set_up_task_sets(CLI::App* command) {
  CLI::App* const sets = command->add_subcommand(
      "tasks", "Writes random task sets for takt rta METHOD --lines, each a line of JSON");
  const auto options = std::make_shared<TaskSetOptions>();
  const auto count = std::make_shared<std::size_t>(1000);
  sets->add_option("METHOD", options->method, "What is to read them; see: takt rta")->required();
  whole_number(sets->add_option("--seed", options->seed, "Another seed gives other sets"), 0,
               999'999'999'999);
  whole_number(sets->add_option("--sets", *count, "How many (default: 1000)"), 1, 10'000'000);
  whole_number(sets->add_option("--tasks", options->tasks, "In each set (default: 5)"), 1, 1000);
  whole_number(sets->add_option("--processors", options->processors,
                                "For so many, where the method knows several (default: 1)"),
               1, 1024);
  number(sets->add_option("--least", options->least_utilisation,
                          "Their least utilisation (default: 0.05)"),
         0.001, 1024);
  number(sets->add_option("--most", options->most_utilisation, "Their largest one (default: 1)"),
         0.001, 1024);
  sets->footer(
      "Utilisations are drawn evenly from --least to --most, and divided by UUniFast, or above 1 "
      "by RandFixedSum; periods\n"
      "are those of cars (WATERS 2015), in microseconds; deadlines are periods, a shorter period "
      "is more urgent, and the\n"
      "shortest execution is half of the longest, where the method asks.\n\n"
      "Example: which sets does the analysis show to be schedulable?\n"
      "  takt random tasks np_fp --tasks 10 | takt rta np_fp --lines > sets.jsonl\n");
  sets->callback([options, count] {
    if (options->least_utilisation > options->most_utilisation) {
      throw Error(fmt::format("--least {} is above --most {}", options->least_utilisation,
                              options->most_utilisation),
                  "exchange them");
    }
    const std::size_t most = std::min(options->processors, options->tasks);
    if (options->most_utilisation > static_cast<double>(most)) {
      throw Error(fmt::format("--most {} is above {}, the number of processors or of tasks",
                              options->most_utilisation, most),
                  "give --processors, or more --tasks");
    }
    analysis::textbook::analyses().check(options->method);
    check_task_sets_for(*options);
    for (std::size_t i = 1; i <= *count; ++i) {
      rt::print("{}\n", rt::json_text(random_task_set(*options, i)));
    }
  });
}

void set_up(CLI::App* command) {
  set_up_task_sets(command);
  const auto options = std::make_shared<RandomOptions>();
  const auto cpus = std::make_shared<std::string>(), path = std::make_shared<std::string>();
  const auto lines = std::make_shared<std::size_t>(0);
  whole_number(command->add_option("--seed", options->seed, "Another seed gives another system"), 0,
               999'999'999'999'999'999);
  command
      ->add_option("--executors", options->executors,
                   "The types to choose from: events,multi_threaded (default: all; see: takt list "
                   "executors)")
      ->delimiter(',');
  command
      ->add_option("--schedulers", options->schedulers,
                   "The schedulers to choose from: edf,fifo (default: all; see: takt list "
                   "schedulers)")
      ->delimiter(',');
  command->add_option("--cpus", *cpus,
                      fmt::format("The CPUs of the threads: 0-1,3 (default: the first {} of those "
                                  "that this process may use)",
                                  kUsualCpus));
  auto* const file =
      add_output(*command, "-o,--output", *path, "Write to this file (default: stdout)");
  whole_number(command->add_option("--lines", *lines,
                                   "So many systems for takt analyze --lines, each a line of JSON, "
                                   "with the seeds from --seed on as ids"),
               1, 10'000'000)
      ->excludes(file);
  command->footer(
      "Examples:\n"
      "  takt random --seed 7 -o system.yaml && takt analyze system.yaml\n"
      "  takt random --seed 8 --executors events,single_threaded --schedulers fixed_priority\n"
      "  takt random --seed 1 --lines 1000 | takt analyze --lines > systems.jsonl\n"
      "  takt random tasks np_fp --tasks 10 | takt rta np_fp --lines > sets.jsonl\n");
  command->callback([command, options, cpus, path, lines] {
    if (!command->get_subcommands().empty()) return;
    if (command->count("--seed") == 0) throw CLI::RequiredError("--seed");
    if (options->executors.empty()) options->executors = executors_to_draw();
    if (options->schedulers.empty()) options->schedulers = schedulers().names();
    options->cpus = parse_cpu_set(cpus->empty() ? "all" : *cpus);
    if (cpus->empty() && options->cpus.size() > kUsualCpus) options->cpus.resize(kUsualCpus);
    for (const std::string& name : options->executors) {
      executors().check(name);
      if (!executors().traits(name).takes_band) continue;
      throw Error(fmt::format("no system is drawn for executors of type '{}'", name),
                  "its threads have a band of priorities; choose another type");
    }
    for (const std::string& name : options->schedulers) schedulers().check(name);
    if (*lines != 0) return write_lines(*options, *lines);
    write(*options, *path);
  });
}
const Command registered("random",
                         "Writes random systems, to run, check and analyze, and task sets", set_up);

}  // namespace
}  // namespace takt::tools::random_command
