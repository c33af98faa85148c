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

/// The containers of a file, on one clock: their topics meet in this process. They enter each phase
/// together, as those of a run do.
/// Thread safety: none. Real-time: no.
class SimulatedProcesses {
 public:
  /// `processes`: of the system. Throws Error, as containers do.
  SimulatedProcesses(const SystemDescription& system,
                     const std::vector<SystemDescription>& processes,
                     const ContainerOverrides& overrides);

  bool are_several() const noexcept { return containers_.size() > 1; }
  /// As the model has them.
  std::span<const ModelledProcess> modelled() const noexcept { return modelled_; }
  /// The callbacks and nodes of all, in this order.
  const ModelledProcess& all() const noexcept { return all_; }
  /// Of the file: also those that go through several processes.
  const std::vector<PlannedChain>& chains() const noexcept { return chains_; }

  void start(Wire& wire);
  void release();
  /// What has been sent is served, up to a limit; then all threads end. Rethrows the exception of a
  /// callback.
  void end(ManualClock& clock, Wire& wire);
  /// Of all, put together; of several, chains are those of the processes.
  ProcessResult result() const;

 private:
  void drain(ManualClock& clock, Wire& wire);
  bool is_any_pending() const;

  std::vector<std::unique_ptr<Container>> containers_;
  std::vector<ModelledProcess> modelled_;
  ModelledProcess all_;
  std::vector<PlannedChain> chains_;
};

/// What threads have asked for is what they have; the machine that simulates shows nowhere. `use`:
/// when the run was over. Returns their numbers in the result.
std::map<const CpuModel::Thread*, int> set_virtual(ProcessResult& result,
                                                   std::vector<ManualClock::Use> use,
                                                   Nanoseconds duration);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATED_PROCESSES_HPP_
