// Runs a system in one or several processes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROCESSES_HPP_
#define TAKT_TOOLS_TAKT_PROCESSES_HPP_

#include <string>
#include <vector>

#include "takt/containers/container.hpp"
#include "takt/measuring/run.hpp"

#include "run/end_signals.hpp"

namespace takt::tools {

/// How a system is run.
struct RunOptions {
  ContainerOverrides overrides;
  Nanoseconds duration{0};  // 0: until a signal
  /// The only process starts empty, and loads its components one by one while it runs.
  bool loads = false;
  /// Also the only process is a program of its own.
  bool apart = false;
  /// The command line that makes this program one process of the system, but for what tells which:
  /// --process NAME --connection DESCRIPTOR.
  std::vector<std::string> words;
};

/// A run and how it ended.
struct FinishedRun {
  rt::Run run;
  std::vector<std::string> failed;  // why it has failed
  int signal = 0;                   // that has ended it before its time; 0: none
};

/// The thread `signals` gets those of the file, if it has some.
void give_attributes(const EndSignals& signals, const SystemDescription& system);

/// Runs the processes of a system in common phases: all construct their components, discover each
/// other and start before the first timer is released; at the end, all timers stop and messages in
/// transit are served before any process ends. A single process is this one. EndSignals end the run
/// cleanly, and in bounded time even while a component's constructor runs; with a duration of zero,
/// only they end it. If a process ends before the first timers are released, or during stop, throws
/// Error with its name. If one ends in between, it is restarted if its description demands it, and
/// the others continue. The output of several processes is printed with their names.
///
/// Call it before the process has other threads. `failed` has a text for each process that ended
/// and was not restarted. Where there are several, this one and RouDi, if the run has started it,
/// have a place among the processes.
FinishedRun run_processes(const std::vector<SystemDescription>& processes,
                          const RunOptions& options);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROCESSES_HPP_
