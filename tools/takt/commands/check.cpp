// takt check: validates files.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "run/construction.hpp"

namespace takt::tools::check_command {

namespace {

/// What the file alone does not tell.
void note_what_is_not_counted(const SystemDescription& system) {
  for (const ExecutorDescription& executor : system.executors) {
    const bool has_reservations =
        std::any_of(executor.threads.begin(), executor.threads.end(), [&](const auto& name) {
          const ThreadDescription* const thread = find_thread(system, name);
          return thread != nullptr && thread->attributes.policy == ThreadPolicy::deadline;
        });
    if (executor.per != Isolation::group || !has_reservations) continue;
    rt::to_stderr(
        "note: how many groups of '{}' have a thread, and so a reservation, only their nodes know: "
        "--construct counts them\n",
        executor.name);
  }
}

/// Errors that a constructor shows, of all processes of the file.
void construct(const SystemDescription& system, std::vector<std::string>& errors) {
  const std::size_t before = errors.size();
  const auto add = [&](SystemDescription described, Construct what) {
    const std::vector<std::string> more = errors_of_construction(std::move(described), what);
    errors.insert(errors.end(), more.begin(), more.end());
  };
  for (SystemDescription& process : split(system, Composition::file))
    add(std::move(process), Construct::process);
  if (errors.size() == before) add(system, Construct::file);
}

void check(const std::vector<std::string>& files, bool constructs) {
  std::vector<std::string> errors;
  for (const std::string& file : files) {
    try {
      const SystemDescription system = read_system(file);
      for (const std::string& note : system.notes) rt::to_stderr("note: {}\n", note);
      const bool is_of_program =
          !system.components.empty() && system.components.front().type.empty();
      if (constructs) {
        if (is_of_program) {
          throw UsageError("--construct is for files with containers, not for those of a program",
                           "leave it out: takt run FILE -- PROGRAM", file);
        }
        const std::size_t before = errors.size();
        construct(system, errors);
        if (errors.size() != before) continue;
      } else {
        note_what_is_not_counted(system);
      }
      rt::print("{}: valid: {}, {}, {}\n", file,
                counted(system.components.size(), is_of_program ? "node" : "component"),
                counted(system.executors.size(), "executor"),
                counted(system.threads.size(), "thread"));
    } catch (const ConfigurationError& error) {
      errors.insert(errors.end(), error.errors().begin(), error.errors().end());
    }
  }
  if (!errors.empty()) throw ConfigurationError(errors);
}

void set_up(CLI::App* command) {
  const auto files = std::make_shared<std::vector<std::string>>();
  command->add_option("FILE", *files, "Configuration files, or workloads in the iRobot JSON format")
      ->required();
  const auto constructs = std::make_shared<bool>(false);
  command->add_flag("--construct", *constructs,
                    "Also construct the components, each container in a process of its own that "
                    "discovers no other: errors that only constructors show");
  command->footer("Example:\n  takt check robot.yaml\n  takt check --construct robot.yaml\n");
  command->callback([files, constructs] { check(*files, *constructs); });
}
const Command registered(
    "check", "Validates files without running them; reports errors as FILE:LINE: what; what to do",
    set_up);

}  // namespace
}  // namespace takt::tools::check_command
