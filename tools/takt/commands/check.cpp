// takt check: validates files; on request it also bounds the latencies of their chains.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "analyze/analyzed_file.hpp"
#include "commands.hpp"
#include "table.hpp"

namespace takt::tools::check_command {

namespace {

/// Reports each chain that may miss its deadline. Returns whether there is none.
bool meets_deadlines(const std::string& path) {
  const AnalyzedFile file = analyze_file(path, {});
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const SystemModel::Chain& chain = file.model.chains[i];
    const ModelBounds::Chain& bound = file.bounds.chains[i];
    if (is_guaranteed(chain, bound)) continue;
    const auto described =
        std::find_if(file.system.chains.begin(), file.system.chains.end(),
                     [&](const auto& each) { return each.options.name == chain.name; });
    rt::to_stderr("{}: chain '{}' {}; see `takt analyze {} --explain {}`\n", described->where,
                  chain.name, why_not_guaranteed(chain, bound), path, chain.name);
  }
  return file.is_guaranteed();
}

void check(const std::vector<std::string>& files, bool checks_deadlines) {
  std::vector<std::string> errors;
  bool meets_all = true;
  for (const std::string& file : files) {
    try {
      const SystemDescription system = read_system(file);
      for (const std::string& note : system.notes) rt::to_stderr("note: {}\n", note);
      rt::print("{}: valid: {} components, {} executors, {} threads\n", file,
                system.components.size(), system.executors.size(), system.threads.size());
      if (checks_deadlines && !meets_deadlines(file)) meets_all = false;
    } catch (const ConfigurationError& error) {
      errors.insert(errors.end(), error.errors().begin(), error.errors().end());
    }
  }
  if (!errors.empty()) throw ConfigurationError(errors);
  if (!meets_all) throw CLI::RuntimeError(1);
}

void set_up(CLI::App* command) {
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto checks_deadlines = std::make_shared<bool>();
  command->add_option("FILE", *files, "Configuration files, or workloads in the iRobot JSON format")
      ->required();
  command->add_flag("--deadlines", *checks_deadlines,
                    "Also construct the components, as `takt analyze` does, and fail unless each "
                    "chain with a deadline meets it for sure");
  command->footer("Examples:\n  takt check robot.yaml\n  takt check --deadlines robot.yaml\n");
  command->callback([files, checks_deadlines] { check(*files, *checks_deadlines); });
}
const Command registered(
    "check", "Validates files without running them; reports errors as FILE:LINE: what; what to do",
    set_up);

}  // namespace
}  // namespace takt::tools::check_command
