// The subcommands: each is one file in commands/, and adds itself.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMMANDS_HPP_
#define TAKT_TOOLS_TAKT_COMMANDS_HPP_

#include <CLI/CLI.hpp>

namespace takt::tools {

/// Exit statuses of the program.
inline constexpr int kBadUsage = 2;
/// What is said of an exception that has no what().
inline constexpr const char* kNoStdException =
    "a callback threw something that is no std::exception";

/// A subcommand, which its one file registers at namespace scope: `set_up` gives it its options,
/// its footer with an example, and its callback.
class Command {
 public:
  Command(const char* name, const char* what, void (*set_up)(CLI::App*));
};

/// All that are registered, by name.
void add_commands(CLI::App& app);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMMANDS_HPP_
