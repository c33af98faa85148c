// takt random: a random system, for comparisons and for tests of analyses.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/version.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/sched/scheduler.hpp"

#include "commands.hpp"
#include "latency/cpu_set.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "random/random_system.hpp"
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

void set_up(CLI::App* command) {
  const auto options = std::make_shared<RandomOptions>();
  const auto cpus = std::make_shared<std::string>(), path = std::make_shared<std::string>();
  whole_number(
      command->add_option("--seed", options->seed, "Another seed gives another system")->required(),
      0, 999'999'999'999'999'999);
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
      "  takt random --seed 8 --executors events,single_threaded --schedulers fixed_priority\n");
  command->callback([options, cpus, path] {
    if (options->executors.empty()) options->executors = executors().names();
    if (options->schedulers.empty()) options->schedulers = schedulers().names();
    options->cpus = parse_cpu_set(cpus->empty() ? "all" : *cpus);
    if (cpus->empty() && options->cpus.size() > kUsualCpus) options->cpus.resize(kUsualCpus);
    write(*options, *path);
  });
}
const Command registered("random", "Writes a random system: a file to run, check and analyze",
                         set_up);

}  // namespace
}  // namespace takt::tools::random_command
