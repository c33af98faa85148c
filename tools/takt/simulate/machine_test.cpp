// A simulation and the analysis beside each other, where they once were of different machines.
// SPDX-License-Identifier: Apache-2.0
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/simulation/simulation.hpp"
#include "takt/testing/random_system.hpp"

#include "analyze/analyzed_file.hpp"
#include "random/random_system.hpp"
#include "yaml_file.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

Nanoseconds bound_of_chain(const SystemDescription& system, std::string_view name) {
  const AnalyzedFile file = analyze_system(system, {.machine = MachineFacts{}});
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

/// A timer on CPU 0, and a less urgent one.
std::string spinning_file(std::string_view spins, int other_cpu) {
  return fmt::format(R"(
machine: {{cpus: 2, exclusive: true, rt_runtime: unlimited, overheads: {{wake: 100us}}}}
threads: {{h: {{policy: SCHED_FIFO, priority: 80, affinity: [0]}}, l: {{policy: SCHED_FIFO, priority: 78, affinity: [{1}]}}}}
executors: {{eh: {{type: events, threads: [h]{0}}}, el: {{type: events, threads: [l]}}}}
chains: [{{name: high, path: [high/b_timer]}}, {{name: low, path: [low/a_timer]}}]
container:
  name: robot
  components:
    - {{component: takt::Workload, name: high, executor: eh, parameters: {{publishers: {{topic: [b], period_us: [10000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: low, executor: el, parameters: {{publishers: {{topic: [a], period_us: [10000], work_us: [2000]}}}}}}
)",
                     spins, other_cpu);
}

// Spinning was refused: what came meanwhile would have paid for waking up, and nobody for the spin.
TEST(SimulatedMachine, AThreadThatSpinsKeepsItsCpu) {
  struct Expected {
    std::string_view spins;
    int other_cpu;
    Nanoseconds high, low, used;  // in each period, by the urgent thread
  };
  for (const Expected& expected :
       {Expected{"", 0, 1100us, 3100us, 1000us},
        Expected{", early_wake: 150us", 0, 1000us, 3000us, 1050us},
        Expected{", spin: 300us", 0, 1100us, 3400us, 1300us},
        Expected{", early_wake: 150us, spin: 300us", 0, 1000us, 3300us, 1350us},
        Expected{", spin: always", 1, 1000us, 2100us, 10000us}}) {
    const SystemDescription system =
        ConfigurationFile("system.yaml", spinning_file(expected.spins, expected.other_cpu)).read();
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 1s});
    const SimulatedRun run = simulation.run(parse_scenario("1,worst,all=5ms"));
    const auto& chains = run.result.chains;
    EXPECT_EQ(chains.at(0).statistics.latency.max(), expected.high) << expected.spins;
    EXPECT_EQ(chains.at(1).statistics.latency.max(), expected.low) << expected.spins;
    EXPECT_NEAR(static_cast<double>(run.result.threads.at(0).statistics.cpu_time.count()),
                100.0 * static_cast<double>(expected.used.count()), 1e6)
        << expected.spins;
    EXPECT_LE(expected.high, bound_of_chain(system, "high")) << expected.spins;
    EXPECT_LE(expected.low, bound_of_chain(system, "low")) << expected.spins;
  }
}

// A CPU with 936 ms of work in a second, and 20 ms in which it is searched, is taken away by Linux,
// with the release for which its thread waits. Only the work was counted: the bound was 936 us.
TEST(SimulatedMachine, WhatAPoolSearchesIsOfLinuxGrant) {
  for (const int work_us : {800, 935}) {
    const SystemDescription system = ConfigurationFile("system.yaml", fmt::format(R"(
machine: {{cpus: 2, exclusive: true, rt_runtime: 950ms}}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}}}
executors: {{pool: {{type: events, threads: [a, b]}}}}
chains: [{{name: often, path: [often/l_timer]}}]
container:
  name: robot
  components:
    - {{component: takt::Workload, name: often, executor: pool, parameters: {{publishers: {{topic: [l], period_us: [1000], work_us: [{}]}}}}}}
    - {{component: takt::Workload, name: source, executor: pool, parameters: {{publishers: {{topic: [x], period_us: [1000], work_us: [1]}}}}}}
    - {{component: takt::Workload, name: reader, executor: pool, parameters: {{subscriptions: {{topic: [x], work_us: [1]}}}}}}
)",
                                                                                  work_us))
                                         .read();
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 2s});
    const SimulatedRun run = simulation.run(parse_scenario(
        fmt::format("1,worst,/often/l_timer=0s,/source/x_timer={}500ns", work_us - 1)));
    const Nanoseconds longest = run.result.chains.at(0).statistics.latency.max();
    const Nanoseconds bound = bound_of_chain(system, "often");  // 0: none
    EXPECT_EQ(longest > 1ms, bound == 0ns) << work_us << " us: " << longest.count();
  }
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

// A thread that has no work left when a more urgent one wakes up has ended: it was preempted, and
// its end was late by what the other one takes. Round numbers are what people write.
TEST(SimulatedMachine, WhatEndsAsAnotherBeginsIsNotPreempted) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0], exclusive: true, rt_runtime: unlimited}
threads: {h: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, l: {policy: SCHED_FIFO, priority: 40, affinity: [0]}}
executors: {h: {type: events, threads: [h]}, l: {type: events, threads: [l]}}
chains: [{name: low, path: [low/a_timer]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: high, executor: h, parameters: {publishers: {topic: [b], period_us: [10000], work_us: [4000]}}}
    - {component: takt::Workload, name: low, executor: l, parameters: {publishers: {topic: [a], period_us: [20000], work_us: [6000]}}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 100ms});
  EXPECT_EQ(bound_of_chain(system, "low"), 10ms);
  EXPECT_EQ(simulation.run({}).result.chains.at(0).statistics.latency.max(), 10ms);
}

// Scaled work is whole nanoseconds before its CPU's speed divides it.
TEST(SimulatedMachine, ScaledWorkIsRoundedAsInItsBound) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0], exclusive: true, rt_runtime: unlimited, speed: {0: 0.63}}
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
executors: {a: {type: events, threads: [a]}}
chains: [{name: c, path: [s/t_timer]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: s, executor: a, parameters: {publishers: {topic: [t], period_us: [50000], work_us: [100]}}, callbacks: {t_timer: {execution: 5874947ns}}}
)";
  SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  system.execution_scales["/s/t_timer"] = 0.3;
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 60ms});
  EXPECT_LE(simulation.run({}).result.chains.at(0).statistics.latency.max(),
            bound_of_chain(system, "c"));
}

// When timers release no more, a join got its last input from a callback that runs for long, and so
// its instance was late by that. No timer, no instance.
TEST(SimulatedMachine, TheEndOfARunMakesNoJoinLate) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0, 1], exclusive: true, rt_runtime: unlimited}
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, affinity: [1]}}
executors: {a: {type: events, threads: [a]}, b: {type: events, threads: [b]}}
chains: [{name: c, path: [often/p_timer, join/p, last/r]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: seldom, executor: b, parameters: {publishers: {topic: [q], period_us: [40000], work_us: [36000]}}}
    - {component: takt::Workload, name: often, executor: a, parameters: {publishers: {topic: [p], period_us: [10000], work_us: [60]}}}
    - {component: takt::Workload, name: join, executor: a, parameters: {relays: {input: [p, q], output: [r, r], work_us: [500, 500]}}}
    - {component: takt::Workload, name: last, executor: a, parameters: {subscriptions: {topic: [r], work_us: [500]}}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  const Nanoseconds bound = bound_of_chain(system, "c");
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 200ms});
  for (auto phase = 0ms; phase < 40ms; phase += 5ms) {
    const SimulatedRun run = simulation.run({.phases = {{"/seldom/q_timer", phase}, {"all", 0ns}}});
    const ChainStatistics chain = run.result.chains.at(0).statistics;
    EXPECT_GE(chain.instances, 3u);
    EXPECT_LE(chain.latency.max(), bound) << to_string(phase);
  }
}

// What switches cost was counted for threads of SCHED_FIFO of one CPU each: not at the end of a
// slice of SCHED_RR, not between reservations, and not where a thread that may move comes because
// its CPU was taken.
TEST(SimulatedMachine, EachSwitchIsInABound) {
  struct Case {
    const char *switches, *threads, *cpus, *work_us;
    Nanoseconds duration;
  };
  const Case cases[] = {
      {"100us", "a: {policy: SCHED_RR, priority: 60}, b: {policy: SCHED_RR, priority: 60}", "[0]",
       "450000 350000", 2s},
      {"20us",
       "a: {policy: SCHED_DEADLINE, runtime: 10ms, period: 20ms}, b: {policy: "
       "SCHED_DEADLINE, runtime: 200us, period: 1ms}",
       "[0]", "500000 100", 4s},
      {"50us",
       "a: {policy: SCHED_FIFO, priority: 60, affinity: [1]}, b: {policy: SCHED_FIFO, "
       "priority: 70}, c: {policy: SCHED_FIFO, priority: 80, affinity: [0]}, d: {policy: "
       "SCHED_FIFO, priority: 81, affinity: [1]}",
       "[0, 1]", "100000 300000 100 100", 4s}};
  for (const Case& each : cases) {
    std::string executors, components;
    std::istringstream works(each.work_us);
    char name = 'a';
    for (std::string work; works >> work; ++name) {
      executors += fmt::format("  e{0}: {{type: events, threads: [{0}]}}\n", name);
      components += fmt::format(
          "    - {{component: takt::Workload, name: n{0}, executor: e{0}, parameters: "
          "{{publishers: "
          "{{topic: [{0}], period_us: [{1}], work_us: [{2}]}}}}}}\n",
          name, work == "100" ? 2'000 : 2'000'000, work);
    }
    const SystemDescription system =
        ConfigurationFile(
            "system.yaml",
            fmt::format(
                "machine: {{cpus: {}, exclusive: true, rt_runtime: unlimited, overheads: "
                "{{switch: {}}}}}\nthreads: {{{}}}\nexecutors:\n{}chains: [{{name: c, path: "
                "[na/a_timer]}}]\ncontainer:\n  name: robot\n  components:\n{}",
                each.cpus, each.switches, each.threads, executors, components))
            .read();
    const Nanoseconds bound = bound_of_chain(system, "c");
    ASSERT_GT(bound, 0ns) << each.threads;
    const Simulation simulation(system,
                                {.overrides = {}, .measured = {}, .duration = each.duration});
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const SimulatedRun run = simulation.run({.seed = seed, .phases = {}});
      EXPECT_LE(run.result.chains.at(0).statistics.latency.max(), bound) << each.threads;
    }
  }
}

// Each of two subscriptions that state how often messages come got those of both.
TEST(SimulatedMachine, ATopicFromOutsideHasItsMessagesOnce) {
  constexpr std::string_view kText = R"(
machine: {cpus: [0], exclusive: true, rt_runtime: unlimited}
threads: {one: {policy: SCHED_FIFO, priority: 80, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [k/x]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: k, executor: default, parameters: {subscriptions: {topic: [x], work_us: [1000]}}, callbacks: {x: {arrival: {period: 10ms}}}}
    - {component: takt::Workload, name: l, executor: default, parameters: {subscriptions: {topic: [x], work_us: [1000]}}, callbacks: {x: {arrival: {period: 10ms}}}}
)";
  const SystemDescription system = ConfigurationFile("system.yaml", kText).read();
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 1s});
  const ProcessResult result = simulation.run({}).result;
  for (const auto& row : result.callbacks) EXPECT_EQ(row.statistics.received, 100u);
  EXPECT_LE(result.chains.at(0).statistics.latency.max(), bound_of_chain(system, "c"));
}

/// Some of its threads get other policies, the priorities of others, or a second CPU.
std::string with_other_threads(const std::string& text, std::uint64_t seed) {
  std::mt19937_64 draws(seed);
  const std::regex thread("policy: SCHED_FIFO, (priority: [0-9]+), (affinity: .[0-9]+.)");
  std::string result;
  auto rest = text.cbegin();
  for (std::smatch found; std::regex_search(rest, text.cend(), found, thread);
       rest = found.suffix().first) {
    result.append(rest, found.prefix().second);
    const std::string priority = found[1], affinity = found[2];
    switch (draws() % 6) {
      case 0:
        result += fmt::format("policy: SCHED_RR, priority: 45, {}", affinity);
        break;
      case 1:
        result += "policy: SCHED_DEADLINE, runtime: 4ms, period: 10ms";
        break;
      case 2:
        result += fmt::format("policy: SCHED_FIFO, {}, affinity: [0, 1]", priority);
        break;
      case 3:
        result += fmt::format("policy: SCHED_FIFO, priority: 45, {}", affinity);
        break;
      default:
        result += found[0];
    }
  }
  return result.append(rest, text.cend());
}

TEST(SimulatedMachine, NothingTakesLongerThanItsBoundUnderOtherPolicies) {
  std::size_t chains = 0;
  for (std::uint64_t seed = 1; seed <= testing::random_systems(150); ++seed) {
    const RandomOptions options{.seed = seed,
                                .executors = executors_to_draw(),
                                .schedulers = schedulers().names(),
                                .cpus = {0, 1}};
    const std::string text =
        with_other_threads(yaml_file(random_system(options).document), seed) +
        "machine: {cpus: 2, rt_runtime: 950ms, exclusive: true, overheads: {dispatch: 5us, wake: "
        "20us, switch: 100us}}\n";
    const SystemDescription system = ConfigurationFile("system.yaml", text).read();
    const AnalyzedFile file = analyze_system(system, {.machine = MachineFacts{}});
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 1s});
    for (std::uint64_t run = 0; run < 3; ++run) {
      const SimulatedRun simulated = simulation.run({.seed = seed + run, .phases = {}});
      for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
        const auto& bound = file.bounds.chains[i].bound;
        if (!bound) continue;
        ASSERT_LE(simulated.result.chains.at(i).statistics.latency.max(), *bound)
            << file.model.chains[i].name << ", seed " << seed << ", run " << run << ":\n"
            << text;
        ++chains;
      }
    }
  }
  EXPECT_GT(chains, 100u);
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
