// Runs a program written for rclcpp as a system.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROGRAM_HPP_
#define TAKT_TOOLS_TAKT_PROGRAM_HPP_

#include <cstddef>
#include <string>
#include <vector>

#include "takt/base/time.hpp"

#include "run/processes.hpp"

namespace takt::tools {

struct ProgramRun {
  std::vector<std::string> words;  // the program and its arguments
  std::string file, executor, placement,
      scheduler;                 // empty: what the program or its environment has
  Nanoseconds duration{0};       // 0: until it ends, or a signal
  std::size_t trace_events = 0;  // see ExecutorOptions
  bool counts_allocations = false;
  bool has_stdout = true;  // false: what it writes there goes to stderr
};

/// Runs it in a process group of its own, by TAKT_RESULTS. At the end of the duration the group
/// receives SIGINT, and each signal that arrives here; after kEndLimit, or with the second signal,
/// it is killed. Returns what run_processes does. Throws Error if it cannot be started or has
/// written no results; std::runtime_error if it failed without any.
FinishedRun run_program(const ProgramRun& run);

/// Starts the program with the file as its TAKT_CONFIG until it spins, and returns the nodes of the
/// file by TAKT_NODES. Throws as run_program; Error if it has not spun within kEndLimit.
nlohmann::json nodes_of_program(const std::vector<std::string>& words, const std::string& file);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROGRAM_HPP_
