// The containers of a simulation, one for each process, and what they have done.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SIMULATED_PROCESSES_HPP_
#define TAKT_CONTAINERS_SIMULATION_SIMULATED_PROCESSES_HPP_

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/simulation/wire.hpp"

namespace takt {

/// The containers of a file, all in this process and on one clock. They enter each phase together,
/// as in a run.
/// Thread safety: none. Real-time: no.
class SimulatedProcesses {
 public:
  /// `processes`: of the system. Throws Error, as containers do.
  SimulatedProcesses(const SystemDescription& system,
                     const std::vector<SystemDescription>& processes,
                     const ContainerOverrides& overrides);

  bool are_several() const noexcept { return containers_.size() > 1; }
  /// The processes, in the order of the model.
  std::span<const ModelledProcess> modelled() const noexcept { return modelled_; }
  /// The callbacks and nodes of all processes, in the same order.
  const ModelledProcess& all() const noexcept { return all_; }
  /// The chains of the file, also those through several processes.
  const std::vector<PlannedChain>& chains() const noexcept { return chains_; }

  void start(Wire& wire);
  void release();
  /// Serves the messages in transit, up to a time limit; then ends all threads. Rethrows the
  /// exception of a callback.
  void end(ManualClock& clock, Wire& wire);
  /// The merged results of all processes; if there are several, without their chains.
  ProcessResult result() const;

 private:
  void drain(ManualClock& clock, Wire& wire);
  bool is_any_pending() const;

  std::vector<std::unique_ptr<Container>> containers_;
  std::vector<ModelledProcess> modelled_;
  ModelledProcess all_;
  std::vector<PlannedChain> chains_;
};

/// Replaces figures of this machine in the result by those of the simulated one: threads have the
/// attributes that they requested. `use`: the CPU times at the end of the run. Returns the numbers
/// of the threads in the result.
std::map<const CpuModel::Thread*, int> set_virtual(ProcessResult& result,
                                                   std::vector<ManualClock::Use> use,
                                                   Nanoseconds duration);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATED_PROCESSES_HPP_
