// takt help: what all commands have in common.
// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"

namespace takt::tools::help_command {
namespace {

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  command->add_subcommand("exit-status", "What the exit statuses of all commands say")
      ->callback([] { rt::print("{}", exit_status_page()); });
  command->footer("Example:\n  takt help exit-status\n");
}
const Command registered("help", "Explains what all commands have in common", set_up);

}  // namespace
}  // namespace takt::tools::help_command
