// takt check: validates files.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"

namespace takt::tools::check_command {

namespace {

void check(const std::vector<std::string>& files) {
  std::vector<std::string> errors;
  for (const std::string& file : files) {
    try {
      const SystemDescription system = read_system(file);
      for (const std::string& note : system.notes) rt::to_stderr("note: {}\n", note);
      const bool is_of_program =
          !system.components.empty() && system.components.front().type.empty();
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
  command->footer("Example:\n  takt check robot.yaml\n");
  command->callback([files] { check(*files); });
}
const Command registered(
    "check", "Validates files without running them; reports errors as FILE:LINE: what; what to do",
    set_up);

}  // namespace
}  // namespace takt::tools::check_command
