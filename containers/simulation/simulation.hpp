// A system under a virtual clock, on virtual CPUs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_
#define TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_

#include <atomic>
#include <cstdint>
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
  /// Of a program, which has made its nodes (`overrides.find_node`): the bodies of its callbacks
  /// run, and here is the name of the one that does. nullptr: the system has components.
  std::atomic<const std::string*>* running = nullptr;
};

struct SimulatedRun {
  Scenario scenario;     // with the faults that were drawn
  ProcessResult result;  // of all processes; threads have what they asked for
  std::uint64_t executions = 0;
  /// When a timer was released first, or arrivals began, after the begin.
  struct Release {
    std::string callback;
    Nanoseconds phase{0};
    Nanoseconds distance{0};  // to the next one, at least; or the duration
  };
  std::vector<Release> releases = {};
  /// Of each chain in `result`: when, after the begin, its longest instance was released, and its
  /// callbacks began and ended.
  std::vector<std::vector<Nanoseconds>> moments = {};
  /// Which thread had which CPU when, if executions are traced. The numbers of threads are those in
  /// `result`; 0: none, or one that runs no callbacks.
  struct Change {
    TimePoint time{};
    int cpu = 0, before = 0, after = 0;
    bool was_preempted = false;
  };
  std::vector<Change> changes = {};
};

/// Runs the executors, schedulers and callback groups of a description themselves. Their threads
/// are real ones, of which one runs at a time; nothing depends on the machine. Each callback takes
/// the time that its model says. The code of components runs only when they are made; but that of
/// components that say how long they run, such as takt::Workload, does.
/// Thread safety: none; one in a process at a time.
/// Real-time: no.
class Simulation {
 public:
  /// Of a machine that does not say otherwise.
  static constexpr Nanoseconds kUsualRtRuntime = std::chrono::milliseconds(950);

  /// Throws Error for what cannot be simulated.
  Simulation(SystemDescription system, SimulationOptions options);

  /// The same for the same scenario. Throws Error, also for what is seen only now.
  SimulatedRun run(const Scenario& scenario) const {
    ManualClock clock = make_clock(scenario);
    return run(scenario, clock);
  }
  /// The same in two steps, for nodes that are made between these: on this clock.
  ManualClock make_clock(const Scenario& scenario) const;
  SimulatedRun run(Scenario scenario, ManualClock& clock) const;
  /// What it leaves out, for people.
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  /// A callback of a thread that sleeps has begun so long after its release, at the latest, if no
  /// other thread has the CPU.
  Nanoseconds time_to_begin() const;
  const SystemDescription& system() const noexcept { return system_; }
  bool has_several_processes() const noexcept { return processes_.size() > 1; }
  /// Neither `machine:` nor the threads say which CPUs there are.
  bool has_cpus_of_here() const noexcept { return has_cpus_of_here_; }

 private:
  void refuse_what_differs();
  void take_machine();
  void refuse_reservations() const;
  void leave_out_surroundings();
  void bring_up(const ModelledProcess& process) const;
  void check_scales(const ModelledProcess& process, const SystemModel& model) const;

  SystemDescription system_;                  // what is made
  std::vector<SystemDescription> processes_;  // of it
  SystemDescription modelled_;                // of which the numbers are: of CPUs of speed 1
  SimulationOptions options_;
  std::vector<std::string> bring_up_;  // lifecycle nodes
  std::vector<std::string> notes_;
  bool has_cpus_of_here_ = false, do_find_each_other_ = true;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATION_HPP_
