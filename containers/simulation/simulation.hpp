// A system under a virtual clock, on virtual CPUs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_
#define TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/simulation/scenario.hpp"

namespace TAKT_INTERNAL takt {

struct SimulationOptions {
  ContainerOverrides overrides;  // executor, placement, scheduler, trace_events
  std::optional<MeasuredModel> measured;
  Nanoseconds duration = std::chrono::seconds(10);
  FaultKinds faults = {};  // the seed draws some of these, unless the scenario has some
  double speed = 1;        // of all CPUs, times those of the file
  /// For a program that has made its nodes (`overrides.find_node`): the bodies of its callbacks
  /// run, and this has the name of the running one. nullptr: the system has components.
  std::atomic<const std::string*>* running = nullptr;
  /// Another thread sets it: the run that is under way ends soon, without a result.
  std::shared_ptr<const std::atomic<bool>> stops = nullptr;
};

struct SimulatedRun {
  Scenario scenario;     // with the faults that were drawn
  ProcessResult result;  // of all processes; threads have the attributes that they requested
  std::uint64_t executions = 0;
  /// When a timer was released first, or arrivals began, after the begin of the run.
  struct Release {
    std::string callback;
    Nanoseconds phase{0};
    Nanoseconds distance{0};  // the minimum to the next one; at most the duration
  };
  std::vector<Release> releases = {};
  /// For each chain in `result`: the times, after the begin, of the release of its longest
  /// instance, and of the begins and ends of its callbacks.
  std::vector<std::vector<Nanoseconds>> moments = {};
  /// The context switches, if executions are traced. Threads have their numbers in `result`; 0: no
  /// thread, or one that runs no callbacks.
  struct Change {
    TimePoint time{};
    int cpu = 0, before = 0, after = 0;
    bool was_preempted = false;
  };
  std::vector<Change> changes = {};
  bool was_stopped = false;  // by SimulationOptions::stops: nothing else counts
};

/// Runs the executors, schedulers and callback groups of a description themselves, on real threads,
/// of which one runs at a time; so nothing depends on this machine. Each callback takes the time
/// that its model states. Of components only the constructors run, unless they state their
/// execution times, as takt::Workload does.
/// Thread safety: none; one in a process at a time.
/// Real-time: no.
class Simulation {
 public:
  /// The `rt_runtime` of a machine that does not state one.
  static constexpr Nanoseconds kUsualRtRuntime = std::chrono::milliseconds(950);

  /// Throws Error for what cannot be simulated.
  Simulation(SystemDescription system, SimulationOptions options);

  /// Gives the same result for the same scenario. Throws Error, also for causes that only a run
  /// finds.
  SimulatedRun run(const Scenario& scenario) const {
    ManualClock clock = make_clock(scenario);
    return run(scenario, clock);
  }
  /// The same in two steps, for a program that makes its nodes in between, on this clock.
  ManualClock make_clock(const Scenario& scenario) const;
  SimulatedRun run(Scenario scenario, ManualClock& clock) const;
  /// Notes on parts of the system that the simulation leaves out.
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  /// The longest time from a release to the begin of its callback, if its thread sleeps and no
  /// other thread has the CPU.
  Nanoseconds time_to_begin() const;
  const SystemDescription& system() const noexcept { return system_; }
  bool has_several_processes() const noexcept { return processes_.size() > 1; }
  /// Whether the CPUs are those of this machine, as neither `machine:` nor the threads name any.
  bool has_cpus_of_here() const noexcept { return has_cpus_of_here_; }

 private:
  void refuse_what_differs();
  void take_machine();
  void leave_out_surroundings();
  void bring_up(const ModelledProcess& process) const;
  void check_scales(const ModelledProcess& process, const SystemModel& model) const;

  SystemDescription system_;                  // the containers are made from it
  std::vector<SystemDescription> processes_;  // its processes
  SystemDescription modelled_;                // the model is made from it: CPUs of speed 1
  SimulationOptions options_;
  std::vector<std::string> bring_up_;  // lifecycle nodes
  std::vector<std::string> notes_;
  bool has_cpus_of_here_ = false;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_
