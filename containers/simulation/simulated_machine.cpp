// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/simulated_machine.hpp"

#include "takt/containers/model/system_model.hpp"
#include "takt/containers/simulation/draws.hpp"

namespace takt {

MeasuredTimes drawn_overhead(const std::optional<Nanoseconds>& stated,
                             const MeasuredModel* measured,
                             MeasuredTimes MeasuredModel::*overhead) {
  return !stated && measured != nullptr ? measured->*overhead : MeasuredTimes();
}

CpuModel::Options machine_of(const SystemDescription& system, const MeasuredModel* measured,
                             const Scenario& scenario) {
  const MachineDescription& machine = system.machine;
  const Nanoseconds granted = *machine.rt_runtime;
  CpuModel::Options options{
      .cpus = {},
      .change = machine.change.value_or(Nanoseconds::zero()),
      .wake = Nanoseconds(overheads_of(machine, measured).wake),
      .realtime = granted < std::chrono::seconds(1) ? std::optional(granted) : std::nullopt};
  for (const int cpu : machine.cpus) {
    const auto speed = machine.speed.find(cpu);
    options.cpus.push_back(
        {.number = cpu, .speed = speed != machine.speed.end() ? speed->second : 1});
  }
  const MeasuredTimes seen = drawn_overhead(machine.wake, measured, &MeasuredModel::wake_overhead);
  if (scenario.times == Scenario::Times::drawn && seen.are_distributed()) {
    options.drawn_wake = [seen, draws = Draws(~scenario.seed)]() mutable {
      return draws.one_of(seen);
    };
  }
  return options;
}

}  // namespace takt
