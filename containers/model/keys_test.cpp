// Each key of a file that counts in a bound has a test that sees it when it is passed over:
// tools/check/ignored.py. Those that others do not have are here.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

/// A timer that sends to a receiver, 1 ms each, and two others of 2 ms beside them; what is written
/// besides.
struct KeyedFile {
  std::string top, thread = "policy: SCHED_FIFO, priority: 50, affinity: [0]",
                   executor = "type: events, scheduler: fixed_priority", x_keys, y_keys, z_keys,
                   path = "x/x_timer, y/x", chain, more, deadline = "9ms";

  std::string text() const {
    const auto timer = [](const char* name, int work_us, const std::string& keys) {
      return fmt::format(
          "    - component: takt::Workload\n      name: {0}\n      executor: default\n"
          "      parameters: {{publishers: {{topic: [{0}], period_us: [10000], work_us: "
          "[{1}]}}}}\n{2}",
          name, work_us, keys);
    };
    return top + "\nthreads:\n  one: {" + thread +
           "}\n  two: {policy: SCHED_FIFO, priority: 40, affinity: [1]}\n"
           "executors:\n  default: {" +
           executor + ", threads: [one]}\n  other: {type: events, threads: [two]}\n" +
           "chains: [{name: c, deadline: " + deadline + ", path: [" + path + "]" + chain + "}]\n" +
           "container:\n  name: keyed\n  components:\n" + timer("x", 1000, x_keys) +
           "    - component: takt::Workload\n      name: y\n      executor: default\n"
           "      parameters: {subscriptions: {topic: [x], work_us: [1000]}}\n" +
           y_keys + timer("z", 2000, z_keys) + timer("w", 2000, z_keys) + more;
  }
  Analyzed analyzed(const MeasuredModel* measured = nullptr) const {
    return test::analyzed(text(), measured, /*accepts_all=*/true);
  }
  std::optional<Nanoseconds> bound() const { return analyzed().bound().bound; }
};

/// Keys of the callback that both of the others have.
std::string of_others(const std::string& group) {
  return "      callback_groups: {default: {" + group + "}}\n";
}

// ---- Callbacks and groups ----

TEST(Keys, AGroupsPriorityCounts) {
  KeyedFile file{.path = "x/x_timer", .chain = ", priority: 3"};
  const auto before = file.bound();
  file.z_keys = of_others("priority: 90");
  EXPECT_GT(file.bound(), before);
  file.z_keys = "";
  file.x_keys = "      callbacks: {x_timer: {priority: 1}}\n";
  const auto low = file.bound();
  file.x_keys = "      callbacks: {x_timer: {priority: 90}}\n";
  EXPECT_EQ(file.bound(), before);
  file.z_keys = of_others("priority: 80");
  EXPECT_EQ(file.bound(), before);
  file.x_keys = "      callbacks: {x_timer: {priority: 1}}\n";
  EXPECT_GT(file.bound(), low);
}

/// With chains of the others, too.
KeyedFile with_chains(const std::string& priority) {
  return {.executor = "type: events, scheduler: chain_priority",
          .path = "x/x_timer",
          .chain = priority +
                   "}, {name: d, priority: 5, path: [z/z_timer]}, "
                   "{name: e, priority: 5, path: [w/w_timer]"};
}

TEST(Keys, AChainsPriorityCounts) {
  EXPECT_GT(with_chains(", priority: 1").bound(), with_chains(", priority: 9").bound());
}

TEST(Keys, AGroupsDeadlineOrdersItAndMayEndInstances) {
  KeyedFile file{.executor = "type: events, scheduler: edf", .path = "x/x_timer"};
  file.x_keys = of_others("deadline: 8ms");
  const auto before = file.bound();
  file.z_keys = of_others("deadline: 2ms");
  EXPECT_GT(file.bound(), before);
}

TEST(Keys, AGroupsOverrunMayLoseOrDisorder) {
  KeyedFile file;
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.y_keys = of_others("deadline: 1ms, overrun: abort");
  EXPECT_EQ(file.analyzed().verdict(), Verdict::may_lose);
}

TEST(Keys, ReleasesThatMayWaitAreNotLost) {
  KeyedFile file{.executor = "type: events, scheduler: fifo", .path = "x/x_timer"};
  file.more = R"(
    - component: takt::Workload
      name: long
      executor: default
      parameters: {publishers: {topic: [long], period_us: [100000], work_us: [15000]}}
)";
  file.deadline = "30ms";
  EXPECT_EQ(file.analyzed().verdict(), Verdict::may_lose);
  file.x_keys = "      callbacks: {x_timer: {releases: 3}}\n";
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.x_keys = of_others("releases: 3");
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.x_keys = of_others("releases: 3, overrun: skip");
  EXPECT_EQ(file.analyzed().verdict(), Verdict::may_lose);
}

TEST(Keys, AGroupsBudgetAndPeriodArePromises) {
  KeyedFile file{.path = "y/x", .more = R"(
    - component: takt::test::KeyedReceiver
      name: r
      executor: default
      callback_groups: {default: {budget: 2ms, period: 20ms}}
)"};
  const Analyzed found = file.analyzed();
  const std::size_t last = found.model.callbacks.size() - 1;
  EXPECT_EQ(found.model.callbacks[last].execution, Provenance::promised);
  EXPECT_EQ(found.model.system.callbacks[last].execution, Nanoseconds(2ms).count());
  ASSERT_TRUE(found.model.system.callbacks[last].arrivals);
  EXPECT_EQ(found.model.system.callbacks[last].arrivals->least_distance(2),
            Nanoseconds(20ms).count());
}

TEST(Keys, AGroupsExecutorServesIt) {
  KeyedFile file{.path = "x/x_timer"};
  const auto before = file.bound();
  file.z_keys = of_others("executor: other");
  EXPECT_LT(file.bound(), before);
}

TEST(Keys, CriticalityOrders) {
  KeyedFile file = with_chains(", priority: 5");
  file.x_keys = of_others("criticality: 8");
  const auto before = file.bound();
  file.z_keys = of_others("criticality: 9");
  EXPECT_GT(file.bound(), before);
  file.x_keys = "      callbacks: {x_timer: {criticality: 10}}\n";
  EXPECT_EQ(file.bound(), before);
}

// By rate, a fast timer comes before the one of the chain, which by chains is the most urgent.
TEST(Keys, RatesMayGivePriorities) {
  const auto bound = [](const std::string& top) {
    return *bound_of(top + R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, scheduler: fixed_priority, threads: [one]}}
chains: [{name: c, path: [a/b_timer]}]
container: {components: [{component: takt::Workload, name: a, executor: default, parameters: {publishers: {topic: [a, b, c], period_us: [10000, 50000, 50000], work_us: [1000, 2000, 2000]}}}]}
)")
                .bound;
  };
  EXPECT_GE(bound("priorities: rate_monotonic"), bound("") + 1ms);
}

TEST(Keys, AParameterFileGivesParameters) {
  const ConfigurationFile params("params.yaml",
                                 "/x: {ros__parameters: {publishers: {topic: [x], "
                                 "period_us: [10000], work_us: [3000]}}}");
  EXPECT_EQ(bound_of(R"(
machine: {rt_runtime: 1s}
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [x/x_timer]}]
container: {components: [{component: takt::Workload, name: x, executor: default, parameters_file: ')" +
                     params.path() + "'}]}\n")
                .bound,
            3ms);
}

TEST(Keys, OutputsAndTheShortestExecutionMakeJitter) {
  KeyedFile file;
  const auto least = [&] { return file.analyzed().model.system.callbacks[0].least_execution; };
  EXPECT_EQ(least(), Nanoseconds(1ms).count());
  file.x_keys = "      callbacks: {x_timer: {outputs: any}}\n";
  EXPECT_EQ(least(), 0);
  file.x_keys = "      callbacks: {x_timer: {execution: {min: 300us, max: 2ms}}}\n";
  EXPECT_EQ(least(), Nanoseconds(300us).count());
  EXPECT_EQ(file.analyzed().model.system.callbacks[0].execution, Nanoseconds(2ms).count());
}

TEST(Keys, ArrivalsAreAsDeclared) {
  const auto distances = [](const std::string& arrival) {
    KeyedFile file{.more = R"(
    - component: takt::test::KeyedReceiver
      name: r
      executor: default
      callbacks: {nobody: {execution: 1ms, arrival: {)" +
                           arrival + "}}}\n"};
    const analysis::System system = file.analyzed().model.system;
    return std::pair(system.callbacks.back().arrivals->least_distance(2),
                     system.callbacks.back().arrivals->least_distance(3));
  };
  using Pair = std::pair<analysis::Time, analysis::Time>;
  EXPECT_EQ(distances("period: 10ms"), Pair(10'000'000, 20'000'000));
  EXPECT_EQ(distances("period: 10ms, jitter: 2ms"), Pair(8'000'000, 18'000'000));
  EXPECT_EQ(distances("period: 10ms, jitter: 9ms, least_distance: 4ms").first, 4'000'000);
  EXPECT_EQ(distances("distances: [3ms, 9ms]"), Pair(3'000'000, 9'000'000));
}

// ---- Topics ----

/// Of a receiver that starves, so that messages wait.
Analyzed with_topic(const std::string& keys) {
  KeyedFile file{.top = keys.empty() ? "" : "topics: {/x: {" + keys + "}}",
                 .x_keys = of_others("executor: other")};
  std::string text = file.text();
  const auto replace = [&](const std::string& what, const std::string& with) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += with.size()) {
      text.replace(at, what.size(), with);
    }
  };
  replace("topic: [x], period_us: [10000], work_us: [1000]",
          "topic: [x], period_us: [1000], work_us: [10]");
  replace("topic: [x], work_us: [1000]", "topic: [x], work_us: [10]");
  replace("period_us: [10000], work_us: [2000]", "period_us: [200000], work_us: [12000]");
  replace("deadline: 9ms", "deadline: 90ms");
  return analyzed(text, nullptr, /*accepts_all=*/true);
}

TEST(Keys, TheDepthOfATopicMayBeTooSmall) {
  EXPECT_EQ(with_topic("").verdict(), Verdict::may_lose);  // 10, and about 24 wait
  EXPECT_EQ(with_topic("depth: 30").verdict(), Verdict::guaranteed);
  EXPECT_EQ(with_topic("history: keep_all").verdict(), Verdict::guaranteed);
  EXPECT_EQ(with_topic("profile: parameters").verdict(), Verdict::guaranteed);
}

TEST(Keys, ATopicThatIsKeptComesAtTheStart) {
  EXPECT_THAT(with_topic("durability: transient_local").text_of("start_is_over"),
              HasSubstr("as its topic keeps it"));
}

// The code asks for more than it offers; the file gives both the same.
TEST(Keys, PoliciesOfTheFileDecideWhatPasses) {
  const auto why_not = [](const std::string& asks, const std::string& topic) {
    const std::string text = topic + R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [s/tick, r/t]}]
container:
  components:
    - {component: takt::test::TrapSender, name: s, executor: default, callbacks: {tick: {execution: 1ms}}}
    - {component: takt::test::TrapReceiver, name: r, executor: default, callbacks: {t: {execution: 1ms}}, parameters: {asks: )" +
                             asks + "}}\n";
    return bound_of(text).why_not;
  };
  for (const auto& [asks, keys] : {std::pair("durability", "durability: transient_local"),
                                   {"deadline", "deadline: 100ms"},
                                   {"liveliness", "liveliness: manual_by_topic"},
                                   {"lease_duration", "lease_duration: 100ms"}}) {
    EXPECT_THAT(why_not(asks, ""), HasSubstr(asks));
    EXPECT_EQ(why_not(asks, fmt::format("topics: {{/t: {{{}}}}}", keys)), "") << keys;
  }
}

// What is sure to take long is no jitter.
TEST(Keys, TheShortestDelayCounts) {
  const auto backlog = [](const char* delay) {
    return analyzed(two_processes(fmt::format("topics: {{/x: {{delay: {{{}}}}}}}\n", delay), 2'000))
        .bounds.all.callbacks[1]
        .backlog;
  };
  EXPECT_GT(backlog("max: 9ms"), backlog("min: 8900us, max: 9ms"));
}

// ---- Threads and executors ----

TEST(Keys, ADeadlineBelowThePeriodHasNoSupply) {
  KeyedFile file{.thread = "policy: SCHED_DEADLINE, runtime: 4ms, deadline: 5ms, period: 10ms"};
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("is shorter than its period"));
}

TEST(Keys, AnExecutorsTypeDecidesWhenCallbacksBecomeReady) {
  KeyedFile file{.x_keys = of_others("priority: 90"), .path = "x/x_timer"};
  const auto at_once = file.bound();
  file.executor = "type: single_threaded, scheduler: fixed_priority";
  EXPECT_GT(file.bound(), at_once);
}

TEST(Keys, EachGroupOfIsolatedMayHaveAThread) {
  KeyedFile file{.executor = "type: isolated, per: group", .z_keys = of_others("priority: 60")};
  const auto found = file.analyzed();
  EXPECT_EQ(found.model.system.executors[0].share->priority, 50);
  EXPECT_EQ(found.model.system.executors[2].share->priority, 60);
  file.executor = "type: isolated, per: node";
  EXPECT_EQ(file.analyzed().model.system.executors[2].share->priority, 50);
}

TEST(Keys, ATriggerMayWaitForEver) {
  for (const char* trigger : {"all", "{one: z/z_timer}"}) {
    KeyedFile file{.executor = fmt::format("type: triggered, trigger: {}", trigger)};
    EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("may wait for ever"));
  }
}

TEST(Keys, AListIsAnOrder) {
  const auto place = [](const char* order) {
    KeyedFile file{.executor = fmt::format("type: events, scheduler: listed, order: [{}]", order)};
    return file.analyzed().model.system.callbacks[0].place;
  };
  EXPECT_LT(place("x/x_timer, z/z_timer, w/w_timer"), place("z/z_timer, w/w_timer, x/x_timer"));
}

TEST(Keys, ATypeHasAnOrderAndMayBeAPool) {
  KeyedFile file{.executor = "type: single_threaded"};
  EXPECT_EQ(file.analyzed().model.system.executors[0].order, analysis::Order::in_windows);
  file.executor = "type: triggered";
  EXPECT_TRUE(file.bound());
  file.executor = "type: multi_threaded";
  std::string text = file.text();
  text.replace(text.find(", threads: [one]"), 16, "");
  EXPECT_GE(analyzed(text).model.system.executors[0].threads, 2u);
}

TEST(Keys, ADeadlineIsAPointOfEdf) {
  KeyedFile file{.executor = "type: events, scheduler: edf", .x_keys = of_others("deadline: 8ms")};
  EXPECT_EQ(file.analyzed().model.system.callbacks[0].point, Nanoseconds(8ms).count());
}

// ---- Libraries ----

TEST(Keys, ASchedulerOfALibraryIsAsked) {
  KeyedFile file{.top = "schedulers: {good: {library: " TAKT_TEST_SCHEDULERS "}}",
                 .executor = "type: events, scheduler: good"};
  EXPECT_EQ(file.analyzed().model.system.executors[0].order, analysis::Order::arbitrary);
}

TEST(Keys, AnExecutorOfALibraryIsNotCovered) {
  KeyedFile file{.executor = "type: sound, library: " TAKT_TEST_EXECUTORS};
  EXPECT_EQ(file.analyzed().verdict(), Verdict::not_covered);
}

TEST(Keys, AComponentOfALibraryIsMade) {
  KeyedFile file{.more = "    - {component: 'guests::Good', library: " TAKT_TEST_COMPONENTS
                         ", name: guest, executor: default}\n"};
  EXPECT_EQ(file.analyzed().model.chains.size(), 1u);
}

// ---- The file ----

TEST(Keys, AnExceptionEndsTheRunOrAnInstance) {
  KeyedFile file{.more = R"(
    - component: takt::test::KeyedReceiver
      name: r
      executor: default
      callbacks: {nobody: {execution: 1ms, arrival: {period: 1s}}}
)"};
  EXPECT_THAT(file.analyzed().text_of("as_declared"), Not(HasSubstr("exception")));
  file.more += "      on_exception: ignore\n";
  EXPECT_THAT(file.analyzed().text_of("as_declared"),
              HasSubstr("no execution of '/r/nobody' ends with an exception"));
}

TEST(Keys, AContainerRefusesParametersThatTakeAGuaranteeAway) {
  std::string text = KeyedFile{.x_keys = of_others("priority: 50"), .path = "x/x_timer"}.text();
  text.replace(text.find("deadline: 9ms"), 13, "deadline: 4ms");
  const ConfigurationFile file("changed.yaml", text);
  Container container(file.read());
  EXPECT_THAT(
      [&] {
        container.change_parameters(
            "{z: {callback_groups: {default: {priority: 90}}}, "
            "w: {callback_groups: {default: {priority: 90}}}}");
      },
      ::testing::ThrowsMessage<Error>(HasSubstr("with these parameters")));
  container.change_parameters("{z: {callback_groups: {default: {priority: 40}}}}");
}

TEST(Keys, NobodyKnowsWhenAWaitableIsTriggered) {
  KeyedFile file{.executor = "type: events, scheduler: fifo", .more = R"(
    - component: takt::test::KeyedReceiver
      name: r
      executor: default
      callbacks: {nobody: {execution: 1ms}}
)"};
  const std::optional<analysis::ArrivalCurve> arrivals =
      file.analyzed().model.system.callbacks.back().arrivals;
  ASSERT_TRUE(arrivals);
  EXPECT_EQ(arrivals->least_distance(5), 0);
}

TEST(Keys, WhatIsWatchedIsChecked) {
  KeyedFile file;
  EXPECT_EQ(file.analyzed().assumption("no_page_faults")->state, Assumption::State::unchecked);
  file.top = "analysis: {watch: true}";
  EXPECT_EQ(file.analyzed().assumption("no_page_faults")->state, Assumption::State::checked);
  EXPECT_EQ(file.analyzed().assumption("realtime_granted")->state, Assumption::State::checked);
  // Of several processes none can watch.
  EXPECT_THAT([] { analyzed(two_processes("analysis: {watch: true}")); },
              ::testing::ThrowsMessage<Error>(
                  HasSubstr("system.yaml:1: `watch` is for a file with one process: there are 2")));
}

TEST(Keys, AThreadMayRunOnTheCpusOfTheMachine) {
  KeyedFile file{.top = "machine: {cpus: [0, 1]}", .thread = "policy: SCHED_FIFO, priority: 50"};
  const auto cpus = [](const std::string& text) {
    return analyzed(text).model.system.executors[0].share->cpus;
  };
  EXPECT_THAT(cpus(file.text()), testing::ElementsAre(0, 1));
  std::string text = file.text();
  text.replace(text.find("[0, 1]"), 6, "[0]");
  text.replace(text.find(", affinity: [1]"), 15, "");
  EXPECT_THAT(cpus(text), testing::ElementsAre(0));
}

TEST(Keys, AContainerKnowsTheModelThatItsFileNames) {
  MeasuredModel measured{.duration = 10s};
  KeyedFile file{.top = "dds: {discovery: localhost}"};
  measured.path = "/m.yaml";
  const auto text = [&] { return file.analyzed(&measured).text_of("nothing_is_changed"); };
  EXPECT_THAT(text(), HasSubstr("gets or unloads"));
  file.top += "\nmodel: /m.yaml";
  EXPECT_EQ(
      text(),
      "no container unloads a component of a chain, or one that sends to a join of it, and no "
      "node gets simulated time (`use_sim_time`)");  // what it loads, it looks at
}

/// Of a program that has made its node itself.
TEST(Keys, AProgramsNodesAreDescribedByTheFile) {
  ignored_key = is_ignored;
  const ConfigurationFile file("program.yaml", R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {own: {type: events, threads: [one]}, other: {type: events}}
chains: [{name: c, path: [n/tick]}]
nodes:
  n:
    executor: own
    on_exception: ignore
    callback_groups: {slow: {executor: other}}
    callbacks: {tick: {execution: 1ms}}
)");
  const SystemDescription description = file.read();
  ignored_key = nullptr;
  const auto node = std::make_shared<Node>("n");
  const auto timer = node->create_timer("tick", 10ms, [] {});
  const auto slow = node->create_callback_group("slow", CallbackGroupType::MutuallyExclusive);
  const auto late = node->create_timer(
      "late", 10ms, [] {}, slow);
  const Container container(description, {.find_node = [&](const auto&) { return node; }});
  const ModelledProcess process = container.modelled();
  const SystemModel model = make_system_model(description, container.plan().chains, {&process, 1});
  ASSERT_EQ(model.callbacks.size(), 2u);
  EXPECT_EQ(model.callbacks[0].execution, Provenance::declared);
  EXPECT_EQ(model.system.executors[model.system.callbacks[0].executor].name, "own");
  EXPECT_EQ(model.system.executors[model.system.callbacks[1].executor].name, "other");
  EXPECT_FALSE(process.nodes.at(0).ends_with_exceptions);
}

// ---- A measured model ----

TEST(Keys, AMeasuredJitterAndMeasuredCausesCount) {
  KeyedFile file{.more = R"(
    - component: takt::test::KeyedReceiver
      name: r
      executor: default
)"};
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/r/nobody",
                                .executions = 100,
                                .longest_execution = 1ms,
                                .period = 10ms,
                                .jitter = 2ms});
  const Analyzed found = file.analyzed(&measured);
  EXPECT_EQ(found.model.system.callbacks.back().arrivals->least_distance(2),
            Nanoseconds(8ms).count());
  measured.callbacks.push_back({.name = "/x/x_timer",
                                .executions = 100,
                                .longest_execution = 1ms,
                                .least_distances = {10ms},
                                .causes = {{"/y/x", 3}}});
  measured.callbacks.push_back({.name = "/y/x",
                                .executions = 300,
                                .longest_execution = 1ms,
                                .least_distances = {0ms, 0ms, 10ms}});
  EXPECT_EQ(file.analyzed(&measured).model.system.callbacks[0].outputs.at(0).messages, 3);
}

/// Gets what nobody sends.
class KeyedReceiver : public Node {
 public:
  explicit KeyedReceiver(const NodeOptions& options) : Node("receiver", options) {
    condition_ = create_guard_condition("nobody", [] {});
  }

 private:
  GuardCondition::SharedPtr condition_;
};

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::KeyedReceiver, "gets what nobody sends")
