// takt help: the help of all commands, and what they have in common.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "prompt/mistakes.hpp"

namespace takt::tools::help_command {
namespace {

constexpr const char* kExitStatus = "exit-status";

void help(const CLI::App& app, const std::vector<std::string>& words) {
  if (words == std::vector<std::string>{kExitStatus}) {
    rt::print("{}", exit_status_page());
    return;
  }
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    const auto named = command->get_subcommands(
        [&word](const CLI::App* each) { return each->get_name() == word; });
    if (named.empty()) {
      std::vector<std::string> names = commands_of(*command);
      if (command == &app) names.emplace_back(kExitStatus);
      throw Error(fmt::format("{} has no command '{}'", full_name(*command), word),
                  names.empty() ? "leave it out" : suggest(word, names));
    }
    command = named.front();
  }
  // Not its help(), which is that of `takt help`, the command that was named.
  rt::print("{}", command->get_formatter()->make_help(command, full_name(*command),
                                                      CLI::AppFormatMode::Normal));
}

void set_up(CLI::App* command) {
  const auto words = std::make_shared<std::vector<std::string>>();
  command->add_option("COMMAND", *words,
                      "A command and its subcommand, or exit-status: what exit statuses say");
  command->footer("Example:\n  takt help topic echo\n  takt help exit-status\n");
  command->callback([command, words] { help(*command->get_parent(), *words); });
}
const Command registered("help", "Prints the help of a command; exit-status: what they say",
                         set_up);

}  // namespace
}  // namespace takt::tools::help_command
