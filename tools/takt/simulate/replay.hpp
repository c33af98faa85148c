// What is simulated, as options of `takt simulate` say it, and how a run of it is repeated.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_REPLAY_HPP_
#define TAKT_TOOLS_TAKT_REPLAY_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include <sched.h>

#include "takt/containers/simulation/simulation.hpp"

#include "run/trace.hpp"

namespace takt::tools {

struct SimulatedFile {
  std::string file, model, as, executor, placement = "file", scheduler, mode, duration = "10s";
  std::vector<std::string> settings;  // KEY=VALUE
  std::vector<std::string> scales;    // NAME=FACTOR
  std::uint64_t cpus = 0;             // 0: those of the file
  double speed = 1;
};

/// Throws Error for what is not KEY=VALUE.
Settings settings_of(const SimulatedFile& file);
/// Throws Error for a bad file.
SystemDescription system_of(const SimulatedFile& file);
SimulationOptions options_of(const SystemDescription& system, const SimulatedFile& file);
/// Whether real-time threads get here what a simulation gives those of a file that does not say it.
bool has_usual_grant(const SystemDescription& system);
/// The command that runs a scenario of it again.
std::string replay_command(const SimulatedFile& file, const Scenario& scenario);

/// The timeline of a run whose threads recorded what they executed, with a row for each CPU.
Trace trace_of(const std::vector<SimulatedRun::Change>& changes, rt::Run run, bool are_several);

/// A scenario with its trace.
struct TracedScenario {
  SimulatedRun run;  // without its result
  Trace trace;
};
/// Runs it again: threads of a simulation without a trace record nothing, and do the same.
TracedScenario traced(const SystemDescription& system, SimulationOptions options,
                      const Scenario& scenario, const std::string& file);

/// One thread of a simulation runs at a time: it hands over to the next one faster on the same CPU.
/// While it lives, the calling thread and those that it makes stay on one.
class StaysOnOneCpu {
 public:
  StaysOnOneCpu();
  ~StaysOnOneCpu();
  StaysOnOneCpu(const StaysOnOneCpu&) = delete;
  StaysOnOneCpu& operator=(const StaysOnOneCpu&) = delete;

 private:
  cpu_set_t before_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_REPLAY_HPP_
