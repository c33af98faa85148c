// What runs on which executor, and which executors run.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::placement_test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// The component of container_test.cpp, with its callback groups `default` and `apart`.
SystemDescription one_ticker() {
  SystemDescription system;
  system.file = "test.yaml";
  system.components.push_back({.type = "takt::test::Ticker", .where = "test.yaml:3"});
  return system;
}

/// Until each callback has run.
ProcessResult run(const SystemDescription& system, const ContainerOverrides& overrides = {}) {
  Container container(system, overrides);
  container.start();
  container.release();
  EXPECT_TRUE(eventually([&] {
    const auto callbacks = container.statistics().callbacks;
    return callbacks.size() == 2 &&
           std::all_of(callbacks.begin(), callbacks.end(),
                       [](const auto& callback) { return callback.received != 0; });
  }));
  container.hold();
  container.stop();
  return container.result();
}

TEST(Placement, PutsAGroupUnderTheExecutorThatTheFileNames) {
  SystemDescription system = one_ticker();
  system.executors = {{.name = "fast", .type = "events"},
                      {.name = "slow", .type = "single_threaded"}};
  system.components[0].executor = "fast";
  system.components[0].callback_groups["apart"] = {.executor = "slow", .where = "test.yaml:5"};
  for (const auto& callback : run(system).callbacks) {
    EXPECT_EQ(callback.executor, callback.statistics.group == "apart" ? "slow" : "fast");
  }
  // Another type changes nothing else.
  const ProcessResult overridden = run(system, {.executor = "triggered"});
  EXPECT_THAT(overridden.notes, IsEmpty());
  for (const auto& callback : overridden.callbacks) {
    EXPECT_EQ(callback.executor, callback.statistics.group == "apart" ? "slow" : "fast");
  }
  for (const auto& executor : overridden.executors) EXPECT_EQ(executor.type, "triggered");
  // On one executor for all there is nothing to choose, and the result says so.
  const ProcessResult merged = run(system, {.executor = "events", .placement = Placement::merged});
  ASSERT_EQ(merged.notes.size(), 1u);
  EXPECT_THAT(merged.notes[0], HasSubstr("test.yaml:5"));
  for (const auto& callback : merged.callbacks) EXPECT_EQ(callback.executor, "events");
}

/// Of the executors' threads: their executor, name and policy.
std::vector<std::string> threads_of(const ProcessResult& result) {
  std::vector<std::string> threads;
  for (const auto& thread : result.threads) {
    threads.push_back(fmt::format("{} {} {}", thread.executor, thread.statistics.in_force.name,
                                  to_string(thread.statistics.asked.policy)));
  }
  return threads;
}

TEST(Placement, RunsNoExecutorForNobody) {
  SystemDescription system = one_ticker();
  system.threads = {{.attributes = {.name = "first"}}, {.attributes = {.name = "second"}}};
  system.executors = {{.name = "fast", .type = "events", .threads = {"first"}},
                      {.name = "spare", .type = "events", .threads = {"second"}}};
  system.components[0].executor = "fast";
  SystemDescription with_chain = system;
  with_chain.chains.push_back({.options = {.name = "tick", .deadline = 1s},
                               .path = {{"/ticker", "timer"}, {"/ticker", "ticks"}}});
  for (const char* type : {"", "single_threaded", "isolated"}) {
    const ProcessResult result = run(system, {.executor = type});
    EXPECT_THAT(threads_of(result), ElementsAre(HasSubstr("fast "))) << type;
    ASSERT_EQ(result.executors.size(), 1u) << type;
    EXPECT_EQ(result.executors[0].threads_given, 1u);
    // A chain whose callbacks have an executor changes nothing.
    const ProcessResult chained = run(with_chain, {.executor = type});
    EXPECT_EQ(threads_of(chained), threads_of(result)) << type;
    EXPECT_GT(chained.chains.at(0).statistics.instances, 0u);
  }
  // Where the file places nothing, Takt assigns; another type shall compare with no chains, too.
  with_chain.executors.clear();
  with_chain.components[0].executor.clear();
  EXPECT_THAT(threads_of(run(with_chain)), ElementsAre("tick tick SCHED_FIFO"));
  EXPECT_THAT(threads_of(run(with_chain, {.executor = "events"})),
              ElementsAre("default default SCHED_OTHER"));
}

TEST(Placement, SaysWhatAnotherTypeCannotUse) {
  SystemDescription system = one_ticker();
  system.threads = {{.attributes = {.name = "first"}}, {.attributes = {.name = "second"}}};
  system.executors = {{.name = "pool", .type = "multi_threaded", .threads = {"first", "second"}}};
  system.components[0].executor = "pool";
  EXPECT_EQ(run(system).threads.size(), 2u);
  const ProcessResult result = run(system, {.executor = "single_threaded"});
  EXPECT_EQ(result.threads.size(), 1u);
  EXPECT_EQ(result.executors.at(0).threads_given, 2u);
  EXPECT_THAT(result.notes, ElementsAre("executor 'pool' is 'single_threaded' here, which cannot "
                                        "use of it: 1 thread"));
}

TEST(Placement, HasItsWordsInOnePlace) {
  for (const std::string& word : placements()) EXPECT_NO_THROW(parse_placement(word)) << word;
  EXPECT_EQ(parse_placement("file"), Placement::file);
  EXPECT_EQ(parse_placement("merged"), Placement::merged);
  EXPECT_THAT([] { parse_placement("merge", "TAKT_PLACEMENT"); },
              testing::ThrowsMessage<Error>("TAKT_PLACEMENT: there is no placement 'merge'; did "
                                            "you mean 'merged'? valid: file, merged"));
}

/// Has no callback at first.
class LateNode : public Node {
 public:
  explicit LateNode(const NodeOptions& options) : Node("late", options) { last = this; }
  void tick() {
    timer_ = create_timer("timer", 1ms, [this] { ++calls; });
  }
  inline static LateNode* last = nullptr;
  std::atomic<int> calls{0};

 private:
  std::shared_ptr<Timer> timer_;
};

TEST(Placement, BeginsAnExecutorWithItsFirstCallback) {
  components().add("test::LateNode", {"late", [](const NodeOptions& options) {
                                        return std::make_unique<Component>(
                                            Component{std::make_shared<LateNode>(options)});
                                      }});
  SystemDescription system;
  system.executors = {{.name = "its", .type = "events"}};
  system.components.push_back({.type = "test::LateNode", .executor = "its"});
  Container container(system);
  container.start();
  container.release();
  EXPECT_THAT(container.statistics().executors, IsEmpty());
  LateNode::last->tick();
  EXPECT_TRUE(eventually([] { return LateNode::last->calls > 0; }));
  EXPECT_EQ(container.statistics().executors.size(), 1u);
  container.hold();
  container.stop();
  EXPECT_EQ(container.result().executors.size(), 1u);
}

TEST(Placement, WhatAnExecutorRefusesIsAtTheLineOfTheComponent) {
  const ConfigurationFile file("robot.yaml", R"(
threads: {a: {policy: SCHED_FIFO, priority: 50}}
executors: {each: {type: isolated, per: group, threads: [a]}}
container:
  components:
    - {component: takt::Workload, name: m, executor: each, callback_groups: {default: {priority: 150}}, parameters: {publishers: {topic: [x], period_us: [1000]}}}
)");
  EXPECT_THAT([&] { const Container container(file.read()); },
              ::testing::ThrowsMessage<Error>(
                  HasSubstr("robot.yaml:6: component 'm': priority 150 does not "
                            "exist for SCHED_FIFO; choose 1 to 99")));
}

}  // namespace
}  // namespace takt::placement_test
