// What is neither a key of a file nor a figure of a run, and counts in a bound: each has a mutation
// of its own that a test here sees (tools/check/mutations.py, "ignored: …").
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/bound_of_test.hpp"
#include "takt/ros2/lifecycle_services.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct Entered {
  int number = 0;
};
TAKT_MESSAGE(Entered, "test/msg/Entered", number);

/// Two timers, of which one sends to `t`, as its code says.
class EntrySender : public Node {
 public:
  explicit EntrySender(const NodeOptions& options) : Node("sender", options) {
    publisher_ = create_publisher<Entered>("t", 10, {.published_by = {"tick"}});
    tick_ = create_timer("tick", 10ms, [] {});
    other_ = create_timer("other", 10ms, [] {});
  }

 private:
  Publisher<Entered>::SharedPtr publisher_;
  Timer::SharedPtr tick_, other_;
};

class EntryReceiver : public Node {
 public:
  explicit EntryReceiver(const NodeOptions& options)
      : Node("receiver", options),
        subscription_(create_subscription<Entered>("t", 10, [](const Entered&) {})) {}

 private:
  std::shared_ptr<void> subscription_;
};

/// What a server of the action `move` has for results: it releases the timer when they expire.
class EntryActions : public Node {
 public:
  explicit EntryActions(const NodeOptions& options) : Node("actions", options) {
    service_ = create_service<lifecycle_msgs::srv::ChangeState>("move/_action/get_result",
                                                                [](const auto&, auto&) {});
    expiry_ = create_timer(
        "move_expiry", 1h, [] {}, nullptr, /*autostart=*/false);
    others_ = create_timer(
        "turn_expiry", 1h, [] {}, nullptr, /*autostart=*/false);
  }

 private:
  std::shared_ptr<void> service_;
  Timer::SharedPtr expiry_, others_;
};

/// Two components of an executor; the first callback of the first is the chain.
std::string of_two(const std::string& executor, const std::string& first,
                   const std::string& second) {
  return R"(
threads:
  one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}
  two: {policy: SCHED_FIFO, priority: 50, affinity: [1]}
machine: {cpus: [0, 1]}
executors: {default: {)" +
         executor + R"(}}
chains: [{name: c, path: [a/a_timer]}]
container:
  components:
    - {name: a, executor: default, )" +
         first + "}\n    - {name: b, executor: default, " + second + "}\n";
}
constexpr const char* kTimer =
    "component: takt::Workload, parameters: {publishers: {topic: [a], period_us: [10000], work_us: "
    "[1000]}}";
constexpr const char* kSubscription =
    "component: takt::Workload, parameters: {subscriptions: {topic: [a], work_us: [1000]}}";
constexpr const char* kOneThread = "type: events, threads: [one]";

const analysis::Callback& callback(const Analyzed& of, const std::string& name) {
  const auto& all = of.model.system.callbacks;
  const auto found = std::find_if(
      all.begin(), all.end(), [&](const analysis::Callback& each) { return each.name == name; });
  if (found == all.end()) throw Error("there is no " + name);
  return *found;
}

TEST(Keys, OnlyWhoIsSaidToSendSends) {
  std::string text = of_two(kOneThread, "component: 'takt::test::EntrySender'",
                            "component: 'takt::test::EntryReceiver'");
  text.replace(text.find("a/a_timer"), 9, "a/tick");
  const Analyzed found = analyzed(text);
  EXPECT_EQ(callback(found, "/a/tick").outputs.size(), 1u);
  EXPECT_EQ(callback(found, "/a/other").outputs.size(), 0u);
}

// It was cancelled, and its model said no word of it.
TEST(Keys, ARunShowsAPeriodIfItHasMostReleases) {
  std::string text = of_two(kOneThread, "component: 'takt::test::EntrySender'",
                            "component: 'takt::test::EntryReceiver'");
  text.replace(text.find("a/a_timer"), 9, "a/tick");
  MeasuredModel measured{.duration = 2s};
  measured.callbacks.push_back({.name = "/a/tick", .executions = 198, .longest_execution = 1ms});
  const auto said = [&] { return analyzed(text, &measured).text_of("as_declared"); };
  EXPECT_THAT(said(), ::testing::Not(HasSubstr("'/a/tick' keeps its period")));
  measured.callbacks[0].executions = 50;
  EXPECT_THAT(said(), HasSubstr("'/a/tick' keeps its period"));
}

// With `--executor`, a type for one thread serves a file that gives its executor two.
TEST(Keys, ATypeMayHaveFewerThreadsThanTheFileGivesIt) {
  const ConfigurationFile file(
      "two.yaml", of_two("type: multi_threaded, threads: [one, two]", kTimer, kSubscription));
  const SystemDescription description = file.read();
  const auto threads = [&](const char* type) {
    const Container container(description, {.executor = type});
    const ModelledProcess process = container.modelled();
    return make_system_model(description, container.plan().chains, {&process, 1})
        .system.executors.at(0)
        .threads;
  };
  EXPECT_EQ(threads(""), 2u);
  EXPECT_EQ(threads("single_threaded"), 1u);
}

TEST(Keys, NoMethodKnowsWhatALibrarySaysOfServing) {
  const auto why_not = [](const char* type, const char* threads) {
    return bound_of(of_two(fmt::format("type: {}, library: {}, threads: {}", type,
                                       TAKT_TEST_EXECUTORS, threads),
                           kTimer, kSubscription))
        .why_not;
  };
  EXPECT_THAT(why_not("with_a_rule", "[one]"), HasSubstr("the rule of type 'with_a_rule'"));
  EXPECT_THAT(why_not("with_bands", "[one, two]"),
              HasSubstr("the workers' policy of type 'with_bands'"));
}

TEST(Keys, AnAnswerComesToWhoHasAsked) {
  const Analyzed found = analyzed(of_two(
      kOneThread,
      "component: takt::Workload, parameters: {publishers: {topic: [a], period_us: [10000], "
      "work_us: [1000]}, servers: {service: [s], work_us: [100]}}",
      "component: takt::Workload, parameters: {clients: {service: [s], period_us: [10000]}}"));
  std::size_t answers = 0;
  for (const analysis::Output& output : callback(found, "/a/s").outputs) {
    answers += found.model.system.callbacks[output.to].name.starts_with("/b/") ? 1 : 0;
  }
  EXPECT_EQ(answers, 1u);
}

// A release that came while the one before it ran was guaranteed, and skipped.
TEST(Keys, WhatIsSkippedIsLost) {
  const auto why_lossy = [](const char* overrun) {
    return bound_of(of_two(kOneThread,
                           fmt::format("component: takt::Workload, parameters: {{publishers: "
                                       "{{topic: [a], period_us: [10000], work_us: [4000]}}}}, "
                                       "callbacks: {{a_timer: {{overrun: {}}}}}",
                                       overrun),
                           "component: takt::Workload, parameters: {publishers: {topic: [b], "
                           "period_us: [100000], work_us: [8000]}}"))
        .why_lossy;
  };
  EXPECT_EQ(why_lossy("catch_up"), "");
  EXPECT_THAT(why_lossy("skip"), HasSubstr("of 2 releases all but one are skipped"));
  EXPECT_THAT(why_lossy("abort"), HasSubstr("may take longer than 10ms, and its `overrun`"));
}

// It counted once an hour.
TEST(Keys, ResultsOfActionsExpireWhenTheyLike) {
  const auto why_not = [](const MeasuredModel* measured) {
    return bound_of(
               of_two(kOneThread, kTimer,
                      "component: 'takt::test::EntryActions', callbacks: {move_expiry: {execution: "
                      "1ms}, turn_expiry: {execution: 1ms}, move/_action/get_result: {execution: "
                      "1ms}}"),
               measured)
        .why_not;
  };
  EXPECT_THAT(why_not(nullptr), HasSubstr("how often '/b/move_expiry' runs"));
  const MeasuredModel measured{.duration = 10s, .callbacks = {{.name = "/b/move_expiry"}}};
  EXPECT_EQ(why_not(&measured), "");
}

TEST(Keys, SimulatedTimeMayRunAtAnySpeed) {
  const auto with = [](const char* more) {
    return bound_of(of_two(kOneThread, kTimer,
                           fmt::format("component: takt::Workload, parameters: {{publishers: "
                                       "{{topic: [b], period_us: [10000], work_us: [100]}}{}}}",
                                       more)));
  };
  EXPECT_TRUE(with("").bound);
  EXPECT_THAT(with(", use_sim_time: true").why_not, HasSubstr("how often '/b/b_timer' runs"));
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::EntrySender, "has two timers")
TAKT_REGISTER_COMPONENT(takt::test::EntryReceiver, "receives")
TAKT_REGISTER_COMPONENT(takt::test::EntryActions, "a server of an action, as far as it matters")
