// takt random: random systems and task sets, for comparisons and for tests of analyses.
// SPDX-License-Identifier: Apache-2.0
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
  for (const std::string& name : options.executors) executors().check(name);
  for (const std::string& name : options.schedulers) schedulers().check(name);
  // With all that has been chosen, so that the command gives the same file elsewhere.
  const std::string text = fmt::format(
      "# Written by takt random --seed {} --executors {} --schedulers {} --cpus {} (Takt {})\n{}",
      options.seed, fmt::join(options.executors, ","), fmt::join(options.schedulers, ","),
      fmt::join(options.cpus, ","), TAKT_VERSION, yaml_file(random_system(options)));
  if (path.empty()) {
    rt::print("{}", text);
    return;
  }
  write_output(path, text);
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
  number(sets->add_option("--least", options->least_utilisation,
                          "Their least utilisation (default: 0.05)"),
         0.001, 1);
  number(sets->add_option("--most", options->most_utilisation, "Their largest one (default: 1)"),
         0.001, 1);
  sets->footer(
      "Utilisations are drawn evenly from --least to --most, and divided by UUniFast; periods are "
      "those of cars\n"
      "(WATERS 2015), in microseconds; deadlines are periods, and a shorter period is more "
      "urgent.\n\n"
      "Example: which sets does the analysis show to be schedulable?\n"
      "  takt random tasks np_fp --tasks 10 | takt rta np_fp --lines > sets.jsonl\n");
  sets->callback([options, count] {
    if (options->least_utilisation > options->most_utilisation) {
      throw Error(fmt::format("--least {} is above --most {}", options->least_utilisation,
                              options->most_utilisation),
                  "exchange them");
    }
    analysis::textbook::analyses().check(options->method);
    check_task_sets_for(options->method);
    for (std::size_t i = 1; i <= *count; ++i) {
      rt::print("{}\n", rt::json_text(random_task_set(*options, i)));
    }
  });
}

void set_up(CLI::App* command) {
  set_up_task_sets(command);
  const auto options = std::make_shared<RandomOptions>();
  const auto cpus = std::make_shared<std::string>(), path = std::make_shared<std::string>();
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
  add_output(*command, "-o,--output", *path, "Write to this file (default: stdout)");
  command->footer(
      "Examples:\n"
      "  takt random --seed 7 -o system.yaml && takt analyze system.yaml\n"
      "  takt random --seed 8 --executors events,single_threaded --schedulers fixed_priority\n"
      "  takt random tasks np_fp --tasks 10 | takt rta np_fp --lines > sets.jsonl\n");
  command->callback([command, options, cpus, path] {
    if (!command->get_subcommands().empty()) return;
    if (command->count("--seed") == 0) throw CLI::RequiredError("--seed");
    if (options->executors.empty()) options->executors = executors().names();
    if (options->schedulers.empty()) options->schedulers = schedulers().names();
    options->cpus = parse_cpu_set(cpus->empty() ? "all" : *cpus);
    if (cpus->empty() && options->cpus.size() > kUsualCpus) options->cpus.resize(kUsualCpus);
    write(*options, *path);
  });
}
const Command registered("random",
                         "Writes random systems, to run, check and analyze, and task sets", set_up);

}  // namespace
}  // namespace takt::tools::random_command
