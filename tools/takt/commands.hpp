// The subcommands: each adds itself to the command line, one file each.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMMANDS_HPP_
#define TAKT_TOOLS_TAKT_COMMANDS_HPP_

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace takt::tools {

/// Exit statuses of the program.
inline constexpr int kBadUsage = 2;
/// What is said of an exception that has no what().
inline constexpr const char* kNoStdException =
    "a callback threw something that is no std::exception";

void add_list(CLI::App& app);
void add_bench(CLI::App& app);
void add_check(CLI::App& app);
void add_run(CLI::App& app);
void add_compare(CLI::App& app);
void add_component(CLI::App& app);
void add_doctor(CLI::App& app);
void add_latency(CLI::App& app);
void add_lifecycle(CLI::App& app);
void add_node(CLI::App& app);
void add_plan(CLI::App& app);
void add_reference(CLI::App& app);
void add_service(CLI::App& app);
void add_topic(CLI::App& app);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMMANDS_HPP_
