// The subcommands. Each is one file in commands/ that registers itself.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMMANDS_HPP_
#define TAKT_TOOLS_TAKT_COMMANDS_HPP_

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "outputs.hpp"

namespace takt::tools {

/// Registers a subcommand, at namespace scope of its file. `set_up` adds the options, a footer with
/// an example, and the callback.
class Command {
 public:
  enum class Takes { words, program };
  Command(const char* name, const char* what, void (*set_up)(CLI::App*),
          Takes takes = Takes::words);
};

/// A program and its arguments: what follows `--` after a command that takes it.
const std::vector<std::string>& program_words();
/// What is measured, as it was written: "robot.yaml", "-- ./program", "robot.yaml -- ./program".
std::string with_program(const std::string& file);

/// The number of words in front of the program; the rest is kept.
int split_program(int argc, char** argv);

/// Makes it `takt`, with all registered subcommands, sorted by name. Returns their outputs.
std::shared_ptr<const Outputs> set_up(CLI::App& app);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMMANDS_HPP_
