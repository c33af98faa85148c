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
  std::string simulated;   // for TAKT_SIMULATE: without other variables of Takt; empty: it runs
};

/// What a program has written, and how it ended.
struct ProgramResults {
  nlohmann::json written;
  std::vector<std::string> failed;
  int signal = 0;
};

/// Runs it in a process group of its own, by TAKT_RESULTS. At the end of the duration the group
/// receives SIGINT, and each signal that arrives here; after kEndLimit, or with the second signal,
/// it is killed. Throws Error if it cannot be started or has
/// written no results; std::runtime_error if it failed without any.
ProgramResults results_of_program(const ProgramRun& run);
/// The same, as run_processes returns it.
FinishedRun run_program(const ProgramRun& run);

/// Starts the program with the file as its TAKT_CONFIG until it spins, and returns the nodes of the
/// file by TAKT_NODES. Throws as run_program; Error if it has not spun within kEndLimit.
nlohmann::json nodes_of_program(const std::vector<std::string>& words, const std::string& file);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROGRAM_HPP_
