// What goes wrong in a simulation when it shall, and how that is repeated.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/simulation/scenario_search.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Each 10 ms the driver sends, which takes 1 ms, and then the planner gets it for 2 ms.
SystemDescription driver_and_planner(const std::string& planner = "on_exception: ignore") {
  return ConfigurationFile("system.yaml", fmt::format(R"(
machine: {{cpus: 1}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50}}}}
executors: {{default: {{type: events, threads: [one]}}}}
chains: [{{name: c, path: [driver/imu_timer, planner/imu]}}]
container:
  components:
    - {{component: takt::Workload, name: driver, parameters: {{publishers: {{topic: [imu], period_us: [10000], work_us: [1000], pass_by: [unique_ptr]}}}}}}
    - {{component: takt::Workload, name: planner, {}, parameters: {{subscriptions: {{topic: [imu], work_us: [2000], depth: [3]}}}}}}
)",
                                                      planner))
      .read();
}

Simulation simulation(FaultKinds faults = {}, const std::string& planner = "on_exception: ignore") {
  return Simulation(driver_and_planner(planner),
                    {.overrides = {}, .measured = {}, .duration = 1s, .faults = std::move(faults)});
}

/// Of the planner in a run with this fault: received and dropped messages, instances of the chain,
/// the longest in ms.
std::vector<std::uint64_t> planner_with(const std::string& fault) {
  const ProcessResult result = simulation().run(parse_scenario("1,worst,all=0s," + fault)).result;
  EXPECT_EQ(result.failures.size(), 0u);
  const auto& planner =
      std::find_if(result.callbacks.begin(), result.callbacks.end(), [](auto& of) {
        return of.statistics.callback == "imu";
      })->statistics;
  EXPECT_EQ(planner.lost(), 0u);
  const auto& chain = result.chains.front().statistics;
  return {planner.received, planner.dropped, chain.instances,
          static_cast<std::uint64_t>(chain.latency.max() / 1ms)};
}

TEST(Faults, EachDoesWhatItsNameSays) {
  EXPECT_THAT(planner_with("lost=/planner/imu@2s"), ElementsAre(100, 0, 100, 3));  // never
  EXPECT_THAT(planner_with("lost=/planner/imu@500ms"), ElementsAre(99, 1, 99, 3));
  // Sent at 501 ms; it comes at 505.
  EXPECT_THAT(planner_with("late=/planner/imu@495ms+10ms"), ElementsAre(100, 0, 100, 7));
  // Those of 501 to 541 ms come at 545: the queue has three places.
  EXPECT_THAT(planner_with("late=/planner/imu@495ms+50ms"), ElementsAre(98, 2, 98, 27));
  EXPECT_THAT(planner_with("doubled=/planner/imu@500ms"), ElementsAre(101, 0, 101, 5));
  EXPECT_THAT(planner_with("reordered=/planner/imu@500ms"), ElementsAre(100, 0, 100, 15));
  // There is no other one: it comes at the end.
  EXPECT_THAT(planner_with("reordered=/planner/imu@985ms"), ElementsAre(100, 0, 100, 11));
  EXPECT_THAT(planner_with("full=/planner/imu@500ms"), ElementsAre(102, 0, 102, 7));
  EXPECT_THAT(planner_with("slow=/planner/imu@500ms"), ElementsAre(99, 0, 99, 21));
  EXPECT_THAT(planner_with("slow=/driver/imu_timer@500ms"), ElementsAre(100, 0, 100, 12));
  EXPECT_THAT(planner_with("throws=/planner/imu@500ms"), ElementsAre(100, 0, 100, 3));
}

TEST(Faults, AreDrawnAndNamed) {
  const Simulation drawn = simulation(parse_fault_kinds("all")), replayed = simulation();
  FaultKinds seen;
  const auto text_of = [](const SimulatedRun& run) {
    return rt::json_text(rt::run_json(rt::run_of(run.result), true));
  };
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedRun run = drawn.run({.seed = seed});
    EXPECT_GE(run.scenario.faults.size(), 1u);
    EXPECT_LE(run.scenario.faults.size(), 3u);
    for (const Fault& fault : run.scenario.faults) seen.insert(fault.kind);
    const std::string word = to_string(run.scenario);
    EXPECT_EQ(text_of(replayed.run(parse_scenario(word))), text_of(run)) << word;
  }
  EXPECT_EQ(seen.size(), 7u);
}

TEST(Faults, ASearchKeepsThemWithTheirScenario) {
  const Simulation drawn = simulation({Fault::Kind::slow}), replayed = simulation();
  ScenarioSearch search(1);
  for (int i = 0; i < 20; ++i) search.add(drawn.run(search.next()), drawn.time_to_begin());
  const ScenarioSearch::Worst& worst = search.worst().front();
  EXPECT_GE(worst.latency, 21ms);
  EXPECT_EQ(replayed.run(worst.scenario).result.chains.front().statistics.latency.max(),
            worst.latency);
}

TEST(Faults, WhatCannotHaveOneIsRefusedByName) {
  const auto error = [](const std::string& fault,
                        const std::string& planner = "on_exception: ignore") {
    try {
      simulation({}, planner).run(parse_scenario("1,worst," + fault));
    } catch (const Error& refused) {
      return std::string(refused.what());
    }
    return std::string();
  };
  EXPECT_THAT(error("lost=/driver/imu_timer@1s"),
              HasSubstr("the scenario has the fault 'lost=/driver/imu_timer@1s', and "
                        "'/driver/imu_timer' is not a subscription; valid: /planner/imu"));
  EXPECT_THAT(error("slow=/planner/imo@1s"), HasSubstr("did you mean '/planner/imu'?"));
  EXPECT_THAT(error("throws=/driver/imu_timer@1s"),
              HasSubstr("is not of a component with `on_exception: ignore`"));
  for (const char* other : {"terminate", "remove_node"}) {
    const std::string planner = fmt::format("on_exception: {}", other);
    EXPECT_THAT(error("throws=/planner/imu@1s", planner), HasSubstr("is not of a component with"));
    const SimulatedRun run = simulation({Fault::Kind::throws}, planner).run({});
    EXPECT_TRUE(run.scenario.faults.empty());
    EXPECT_THAT(run.result.notes,
                ::testing::Contains(HasSubstr("no fault `throws`: the file has no callback that is "
                                              "of a component with `on_exception: ignore`")));
  }
}

}  // namespace
}  // namespace takt::tools
