// Runs of a simulation in a program's own process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROGRAM_SIMULATION_HPP_
#define TAKT_TOOLS_TAKT_PROGRAM_SIMULATION_HPP_

#include <string>

#include <nlohmann/json.hpp>

#include "takt/measuring/run.hpp"

#include "simulate/replay.hpp"

namespace takt::tools {

/// A run of a simulation, and what it has measured.
struct SimulatedOnce {
  SimulatedRun simulated;  // of a program, chains are all that it has as its result
  rt::Run run;
  int signal = 0;  // came meanwhile
};

/// Starts the program that follows `--`, which runs the scenario when it spins, see
/// programs/simulated_program.hpp. `simulation`: of the same file. `trace_events`: see
/// ExecutorOptions. Throws as run_program.
SimulatedOnce simulate_program(const Simulation& simulation, const SimulatedFile& file,
                               const std::string& faults, const Scenario& scenario,
                               std::size_t trace_events = 0);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROGRAM_SIMULATION_HPP_
