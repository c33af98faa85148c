// A simulation and the analysis beside each other, where they once were of different machines.
// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/simulation/simulation.hpp"

#include "analyze/analyzed_file.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

Nanoseconds bound_of_chain(const SystemDescription& system, std::string_view name) {
  const AnalyzedFile file = analyze_system(system, {.is_for_here = false});
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    if (file.model.chains[i].name == name) return file.bounds.chains[i].bound.value_or(0ns);
  }
  return 0ns;
}

// Executors that Takt assigns to chains were analysed on the CPUs of this process, and so two heavy
// chains of a machine with one CPU were guaranteed.
TEST(SimulatedMachine, AssignedExecutorsAreOnTheMachinesCpus) {
  const auto file = [](std::string_view cpus) {
    return ConfigurationFile("system.yaml", fmt::format(R"(
machine: {{cpus: {}, rt_runtime: unlimited, exclusive: true}}
chains:
  - {{name: a, priority: 2, deadline: 10ms, path: [one/x_timer, two/x]}}
  - {{name: b, priority: 1, deadline: 10ms, path: [three/z_timer, four/z]}}
container:
  name: robot
  components:
    - {{component: takt::Workload, name: one, parameters: {{publishers: {{topic: [x], period_us: [20000], work_us: [3000]}}}}}}
    - {{component: takt::Workload, name: two, parameters: {{subscriptions: {{topic: [x], work_us: [3000]}}}}}}
    - {{component: takt::Workload, name: three, parameters: {{publishers: {{topic: [z], period_us: [20000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: four, parameters: {{subscriptions: {{topic: [z], work_us: [1000]}}}}}}
)",
                                                        cpus))
        .read();
  };
  const auto longest_of_b = [](const SystemDescription& system) {
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 100ms});
    return simulation.run({}).result.chains.at(1).statistics.latency.max();
  };
  EXPECT_EQ(longest_of_b(file("1")), 8ms);
  EXPECT_GE(bound_of_chain(file("1"), "b"), 8ms);
  EXPECT_EQ(longest_of_b(file("[4, 5]")), 2ms);  // also of CPUs that are not here
  EXPECT_EQ(bound_of_chain(file("[4, 5]"), "b"), 2ms);
}

// Simulated, a switch took longer on a slow CPU, and in the bound it did not.
TEST(SimulatedMachine, ASlowCpuTakesLongerToSwitch) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0], exclusive: true, rt_runtime: unlimited, speed: {0: 0.5}, overheads: {switch: 100us}}
threads: {h: {policy: SCHED_FIFO, priority: 80, affinity: [0]}, l: {policy: SCHED_FIFO, priority: 78, affinity: [0]}}
executors: {eh: {type: events, threads: [h]}, el: {type: events, threads: [l]}}
chains: [{name: low, path: [low/a_timer, last/a]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: high, executor: eh, parameters: {publishers: {topic: [b], period_us: [5000], work_us: [700]}}}
    - {component: takt::Workload, name: low, executor: el, parameters: {publishers: {topic: [a], period_us: [20000], work_us: [2000]}}}
    - {component: takt::Workload, name: last, executor: el, parameters: {subscriptions: {topic: [a], work_us: [1000]}}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  const Nanoseconds bound = bound_of_chain(system, "low");
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 1s});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const SimulatedRun run = simulation.run({.seed = seed, .phases = {}});
    EXPECT_LE(run.result.chains.at(0).statistics.latency.max(), bound) << seed;
  }
}

// A wait was divided by the speed, and so simulated latencies were above their bounds.
TEST(SimulatedMachine, AWaitIsAsLongOnASlowCpu) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0], exclusive: true, rt_runtime: unlimited, speed: {0: 0.5}}
threads: {one: {policy: SCHED_FIFO, priority: 80, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [one/a_timer]}]
container:
  name: robot
  components:
    - component: takt::Workload
      name: one
      executor: default
      parameters: {publishers: {topic: [a], period_us: [20000], work_us: [1000]}}
      callbacks: {a_timer: {waits: 3ms}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  EXPECT_EQ(bound_of_chain(system, "c"), 5ms);
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 100ms});
  EXPECT_EQ(simulation.run({}).result.chains.at(0).statistics.latency.max(), 5ms);
}

// The end of a run wakes all threads. A more urgent one that did so took the switches of it from a
// callback that had begun, beyond its bound.
TEST(SimulatedMachine, TheEndOfARunTakesNoTime) {
  constexpr std::string_view kText = R"(
threads:
  low: {policy: SCHED_FIFO, priority: 41, affinity: [0]}
  high: {policy: SCHED_FIFO, priority: 42, affinity: [0]}
executors: {low: {type: events, threads: [low]}, high: {type: events, threads: [high]}}
chains: [{name: low, path: [low/a_timer]}]
machine: {cpus: 1, rt_runtime: unlimited, exclusive: true, overheads: {dispatch: 5us, wake: 20us, switch: 3us}}
container:
  name: robot
  components:
    - {component: takt::Workload, name: low, executor: low, parameters: {publishers: {topic: [a], period_us: [10000], work_us: [2500]}}}
    - {component: takt::Workload, name: high, executor: high, parameters: {publishers: {topic: [b], period_us: [10000], work_us: [2500]}}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  const Nanoseconds bound = bound_of_chain(system, "low");
  for (auto duration = 20ms; duration < 30ms; duration += 1ms) {
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = duration});
    const SimulatedRun run = simulation.run({});
    EXPECT_EQ(run.result.chains.at(0).statistics.latency.max(), bound) << to_string(duration);
  }
}

constexpr std::string_view kOneTimer = R"(
executors: {default: {type: events, threads: [a]}}
container:
  name: robot
  components:
    - {component: takt::Workload, name: x, executor: default, parameters: {publishers: {topic: [x], period_us: [10000], work_us: [500]}}}
)";

// On a machine with fewer CPUs than the file, as of --cpus.
TEST(SimulatedMachine, RefusesReservationsThatLinuxWouldRefuse) {
  SystemDescription system =
      ConfigurationFile("system.yaml",
                        "machine: {cpus: 2, rt_runtime: 950ms}\n"
                        "threads: {a: {policy: SCHED_DEADLINE, runtime: 9600us, period: 10ms}}" +
                            std::string(kOneTimer))
          .read();
  const Simulation of_two(system, {.overrides = {}, .measured = {}, .duration = 10ms});
  system.machine.cpus = {0};
  EXPECT_THAT(
      [&] { const Simulation of_one(system, {.overrides = {}, .measured = {}, .duration = 10ms}); },
      ::testing::ThrowsMessage<Error>(::testing::HasSubstr(
          "system.yaml: SCHED_DEADLINE threads reserve 0.96 CPUs, of 0.95 that there are for "
          "them")));
}

// It had a band as if the file did not have the thread, which a run takes for the end of the band.
TEST(SimulatedMachine, ABandEndsBelowTaktsOwnThreads) {
  const SystemDescription system = ConfigurationFile("system.yaml", R"(
machine: {cpus: [0], rt_runtime: unlimited}
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, watchdog: {policy: SCHED_FIFO, priority: 62, affinity: [0]}})" +
                                                                        std::string(kOneTimer))
                                       .read();
  const Simulation simulation(
      system, {.overrides = {.executor = "preemptive"}, .measured = {}, .duration = 20ms});
  EXPECT_THAT(simulation.notes(),
              ::testing::Contains("not simulated: what Takt's own threads do: 'watchdog'"));
  std::vector<std::string> threads;
  for (const auto& thread : simulation.run({}).result.threads)
    threads.push_back(thread.statistics.asked.name);
  EXPECT_THAT(threads, ::testing::ElementsAre("a-60", "a-61"));
}

// Drawn evenly from zero up, and with the longest overheads, its median was no run's.
TEST(SimulatedMachine, DrawsWhatWasMeasured) {
  const SystemDescription system = ConfigurationFile("system.yaml", R"(
machine: {cpus: [0], rt_runtime: unlimited}
threads: {one: {policy: SCHED_FIFO, priority: 80, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [one/x_timer]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: one, parameters: {publishers: {topic: [x], period_us: [20000], work_us: [900]}}}
)")
                                       .read();
  MeasuredModel measured{.margin = 0.5,
                         .dispatch_overhead = {.longest = 7us},  // no more is known of it
                         .wake_overhead = {10us, 15us, 20us, 30us, 40us, 3ms}};
  measured.callbacks.push_back({.name = "/one/x_timer",
                                .executions = 1000,
                                .least_execution = 1ms,
                                .median_execution = 2ms,
                                .p99_execution = 3ms,
                                .longest_execution = 8ms});
  const Simulation simulation(system, {.overrides = {}, .measured = measured, .duration = 100s});
  const auto latency = [&](Scenario::Times times) {
    return simulation.run({.times = times}).result.chains.at(0).statistics.latency;
  };
  const Histogram drawn = latency(Scenario::Times::drawn);
  EXPECT_EQ(drawn.count(), 5000u);
  EXPECT_GE(drawn.min(), 1ms + 10us + 7us);
  EXPECT_NEAR(static_cast<double>(drawn.percentile(0.5).count()), 2.03e6, 0.1e6);
  EXPECT_NEAR(static_cast<double>(drawn.percentile(0.25).count()), 1.53e6, 0.1e6);
  EXPECT_LT(drawn.percentile(0.97), 3100us);
  EXPECT_GT(drawn.percentile(0.999), 4ms);
  EXPECT_LE(drawn.max(), 8ms + 3ms + 7us);
  const Histogram worst = latency(Scenario::Times::worst);
  EXPECT_EQ(worst.min(), 12ms + 3ms + 7us);
  EXPECT_EQ(worst.max(), 12ms + 3ms + 7us);
}

}  // namespace
}  // namespace takt::tools
