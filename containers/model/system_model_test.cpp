// From files to the numbers of the analysis, and to what it says of chains.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/system_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"
#include "takt/containers/model/places.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/sched/ranks.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// U (1 ms, priority 5) sends to S (1 ms); four timers of 5 ms have priority 0.
std::string trap(const std::string& executor, const std::string& machine = "") {
  std::string text = machine + R"(
threads: {main_cpu: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {e: {)" + executor +
                     R"(, scheduler: fixed_priority, threads: [main_cpu]}}
chains: [{name: c, deadline: 12ms, priority: 0, path: [u/t_timer, s/t]}]
container:
  name: trap
  components:
    - component: takt::Workload
      name: u
      executor: e
      parameters: {publishers: {topic: [t], period_us: [100000], work_us: [1000]}}
      callback_groups: {default: {priority: 5}}
    - component: takt::Workload
      name: s
      executor: e
      parameters: {subscriptions: {topic: [t], work_us: [1000]}}
      callback_groups: {default: {priority: 5}}
)";
  for (const char* const name : {"a", "b", "c", "d"}) {
    text += fmt::format(R"(
    - component: takt::Workload
      name: {0}
      executor: e
      parameters: {{publishers: {{topic: [x{0}], period_us: [100000], work_us: [5000]}}}}
)",
                        name);
  }
  return text;
}

// The bound of earlier versions was 12 ms, and 21.9 ms occurred.
TEST(SystemModel, APollingExecutorServesAWholeSnapshotWhateverThePriority) {
  EXPECT_EQ(bound_of(trap("type: single_threaded")).bound, 22ms);
  EXPECT_EQ(bound_of(trap("type: events")).bound, 7ms - 1ns);
}

// "guaranteed" stood beside an observation that was above the bound, or above the deadline.
TEST(SystemModel, WhatWasObservedMayRefuteABound) {
  // 7 ms, and some ns of overheads; the deadline is 12 ms
  const std::string text =
      trap("type: events",
           "machine: {overheads: {dispatch: 1ns, wake: 1ns, switch: 1ns, publish: 1ns}}");
  const Nanoseconds bound = *bound_of(text).bound;
  MeasuredModel measured{.duration = 10s, .chains = {{.name = "c", .longest = bound}}};
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
  measured.chains[0].longest = bound + 1ns;
  EXPECT_EQ(verdict_of(text, &measured), Verdict::refuted);
  measured.chains[0].longest = 12ms + 1ns;
  EXPECT_EQ(verdict_of(text, &measured), Verdict::missed);
  EXPECT_EQ(verdict_of(trap("type: single_threaded")), Verdict::not_shown);
}

TEST(SystemModel, ASimulationShowsThatADeadlineIsMissed) {
  Analyzed polling = analyzed(trap("type: single_threaded"));  // 22 ms; the deadline is 12 ms
  const auto with = [](Analyzed& of, Nanoseconds simulated) {
    of.model.chains.at(0).simulated = simulated;
    return of.verdict();
  };
  EXPECT_EQ(with(polling, 12ms), Verdict::not_shown);
  EXPECT_EQ(with(polling, 12ms + 1ns), Verdict::missed);
  EXPECT_EQ(with(polling, 22ms + 1ns), Verdict::refuted);
  Analyzed events = analyzed(trap("type: events"));
  EXPECT_EQ(with(events, *events.bound().bound), Verdict::bounded_if);
  EXPECT_EQ(with(events, *events.bound().bound + 1ns), Verdict::refuted);
}

TEST(SystemModel, HalfTheSpeedIsTwiceTheExecution) {
  EXPECT_EQ(bound_of(trap("type: single_threaded", "machine: {speed: {0: 0.5}}")).bound, 44ms);
}

TEST(SystemModel, SaysWhatIsNotKnown) {
  std::string text = trap("type: events");
  text.replace(text.find("policy: SCHED_FIFO, priority: 50, "), 34, "");
  const ModelBounds::Chain bound = bound_of(text);
  EXPECT_FALSE(bound.bound);
  EXPECT_THAT(bound.why_not, HasSubstr("thread 'main_cpu' is SCHED_OTHER"));
  EXPECT_EQ(bound_of("machine: {exclusive: true}\n" + text).bound, 7ms - 1ns);
}

TEST(SystemModel, TheFileSaysHowLongACallbackRuns) {
  std::string text = trap("type: events");
  const std::string group = "callback_groups: {default: {priority: 5}}";
  text.replace(text.find(group), group.size(),
               group + "\n      callbacks: {t_timer: {execution: 3ms}}");
  EXPECT_EQ(bound_of(text).bound, 9ms - 1ns);
}

TEST(SystemModel, AMeasuredExecutionCountsWithItsMargin) {
  MeasuredModel measured{.duration = 10s, .margin = 0.5};
  measured.callbacks.push_back(
      {.name = "/u/t_timer", .executions = 100, .longest_execution = 2ms, .causes = {{"/s/t", 1}}});
  EXPECT_EQ(bound_of(trap("type: events"), &measured).bound, 9ms - 1ns);
  measured.callbacks[0].longest_execution = 0ns;  // nothing is known: the component says it
  EXPECT_EQ(bound_of(trap("type: events"), &measured).bound, 7ms - 1ns);
}

TEST(SystemModel, MeasuredOverheadsCountUnlessTheFileSaysThem) {
  MeasuredModel measured{.dispatch_overhead = {.longest = 10us},
                         .wake_overhead = {.longest = 100us}};
  const auto with_model = bound_of(trap("type: single_threaded"), &measured).bound;
  const std::string machine = "machine: {overheads: {dispatch: 10us, wake: 100us}}";
  EXPECT_EQ(with_model, bound_of(trap("type: single_threaded", machine)).bound);
  EXPECT_GT(with_model, 22ms);
  measured.wake_overhead.longest = 5ms;
  EXPECT_EQ(with_model, bound_of(trap("type: single_threaded", machine), &measured).bound);
}

/// A timer, and a callback that something outside of the file may call.
std::string with_server(const std::string& callbacks = "") {
  return R"(
threads: {main_cpu: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, scheduler: fifo, threads: [main_cpu]}}
chains: [{name: c, path: [u/t_timer, s/t]}]
dds: {domain: 77}
container:
  name: served
  components:
    - component: takt::Workload
      name: u
      executor: default
      parameters: {publishers: {topic: [t], period_us: [100000], work_us: [1000]}}
    - component: takt::Workload
      name: s
      executor: default
)" + callbacks +
         "      parameters: {subscriptions: {topic: [t], work_us: [1000]}, servers: {service: [x], "
         "work_us: [4000]}}\n";
}

TEST(SystemModel, WhatCallsFromOutsideIsStatedOrMeasured) {
  ModelBounds::Chain bound = bound_of(with_server());
  EXPECT_FALSE(bound.bound);
  EXPECT_THAT(bound.why_not, HasSubstr("/s/x"));
  EXPECT_EQ(bound_of(with_server("      callbacks: {x: {arrival: {period: 1s}}}\n")).bound, 6ms);
  MeasuredModel measured{.duration = 10s};
  const auto server = [&]() -> MeasuredCallback& { return measured.callbacks[0]; };
  measured.callbacks.push_back({.name = "/s/x"});  // never called
  EXPECT_EQ(bound_of(with_server(), &measured).bound, 2ms);
  server().executions = 1;
  EXPECT_EQ(bound_of(with_server(), &measured).bound, 6ms);
  server().executions = 2;  // how far apart is not known
  EXPECT_FALSE(bound_of(with_server(), &measured).bound);
  server().least_distances = {5s};
  EXPECT_EQ(bound_of(with_server(), &measured).bound, 6ms);
  server().dropped = 1;
  EXPECT_FALSE(bound_of(with_server(), &measured).bound);
  server() = {.name = "/s/x", .executions = 2, .period = 1s, .jitter = 1ms};
  EXPECT_EQ(bound_of(with_server(), &measured).bound, 6ms);
}

/// Two timers on a pool of two threads, each with a CPU; they need so much of each 100 ms.
std::string with_pool(int work_us, const std::string& more = "") {
  std::string text = R"(
threads:
  first: {policy: SCHED_FIFO, priority: 50, affinity: [0]}
  second: {policy: SCHED_FIFO, priority: 50, affinity: [1]}
executors: {pool: {type: multi_threaded, scheduler: fifo, threads: [first, second]}}
machine: {cpus: [0, 1]}
chains: [{name: c, path: [a/x_timer, s/x]}]
container:
  name: pooled
  components:
    - component: takt::Workload
      name: s
      executor: pool
      parameters: {subscriptions: {topic: [x], work_us: [1000]}}
)" + more;
  for (const auto& [name, topic] : {std::pair{"a", "x"}, {"b", "w"}}) {
    text += fmt::format(R"(
    - component: takt::Workload
      name: {}
      executor: pool
      parameters: {{publishers: {{topic: [{}], period_us: [100000], work_us: [{}]}}}}
)",
                        name, topic, work_us);
  }
  return text;
}

// Jiang (RTSS 2022) and Sobhani (RTAS 2023) would give one; it is not for these executors.
TEST(SystemModel, APoolThatNeedsMoreThanACpuHasNoBound) {
  EXPECT_TRUE(bound_of(with_pool(20'000)).bound);
  const ModelBounds::Chain bound = bound_of(with_pool(70'000));
  EXPECT_FALSE(bound.bound);
  EXPECT_THAT(bound.why_not, HasSubstr("pool"));
}

TEST(SystemModel, WhatNobodyPublishesNeverRuns) {
  const std::string orphan = R"(
    - component: takt::Workload
      name: orphan
      executor: pool
      parameters: {subscriptions: {topic: [nobody], work_us: [90000]}}
)";
  EXPECT_EQ(bound_of(with_pool(20'000, orphan)).bound, bound_of(with_pool(20'000)).bound);
}

// The other input may come a period later.
TEST(SystemModel, AChainWaitsForTheOtherInputsOfAJoin) {
  const ModelBounds::Chain bound = bound_of(R"(
threads: {main_cpu: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [main_cpu]}}
chains: [{name: c, path: [left/l_timer, end/j]}]
container:
  name: joined
  components:
    - component: takt::Workload
      name: left
      executor: default
      parameters: {publishers: {topic: [l], period_us: [50000], work_us: [1000]}}
    - component: takt::Workload
      name: right
      executor: default
      parameters: {publishers: {topic: [r], period_us: [80000], work_us: [1000]}}
    - component: takt::Workload
      name: join
      executor: default
      parameters: {relays: {input: [l, r], output: [j, j], work_us: [1000, 1000]}}
    - component: takt::Workload
      name: end
      executor: default
      parameters: {subscriptions: {topic: [j], work_us: [1000]}}
)");
  ASSERT_TRUE(bound.bound);
  EXPECT_GT(*bound.bound, 53ms);
  EXPECT_LT(*bound.bound, 65ms);
}

ModelledThread fifo(std::size_t executor, int priority, std::vector<int> cpus) {
  return {executor,
          {.name = "t" + std::to_string(executor),
           .policy = ThreadPolicy::fifo,
           .priority = priority,
           .affinity = std::move(cpus)}};
}

TEST(Places, ThreadsOfOneCpuShareIt) {
  const std::vector<ModelledThread> threads{fifo(0, 80, {1}), fifo(1, 40, {1}), fifo(2, 60, {0})};
  const auto places = find_places(threads, 3, {0, 1}, false);
  ASSERT_TRUE(places[1].share);
  EXPECT_THAT(places[1].share->cpus, ElementsAre(1));
  EXPECT_EQ(places[1].share->priority, 40);
  EXPECT_EQ(places[2].cpu, 0);
}

TEST(Places, AnUnboundThreadIsAloneOnlyIfThereAreEnoughCpus) {
  const std::vector<ModelledThread> two{fifo(0, 80, {}), fifo(1, 40, {})};
  EXPECT_EQ(find_places(two, 2, {0, 1}, false)[1].unknown, "");
  EXPECT_THAT(find_places(two, 2, {0}, false)[1].share->priority, 40);
  const std::vector<ModelledThread> three{fifo(0, 80, {}), fifo(1, 40, {}), fifo(2, 30, {})};
  EXPECT_THAT(find_places(three, 3, {0, 1}, false)[2].share->cpus, ElementsAre(0, 1));
  EXPECT_EQ(find_places(three, 3, {0, 1}, false)[1].unknown, "");
  // One of two as urgent ones waits for what the other has left over.
  const std::vector<ModelledThread> equal{fifo(0, 80, {}), fifo(1, 30, {}), fifo(2, 30, {})};
  EXPECT_THAT(find_places(equal, 3, {0, 1}, false)[2].unknown, HasSubstr("the same priority"));
  EXPECT_EQ(find_places(equal, 3, {0, 1, 2}, false)[2].unknown, "");
}

TEST(Places, AReservationRunsBeforeAllOthers) {
  const ModelledThread reserved{0,
                                {.name = "reserved",
                                 .policy = ThreadPolicy::deadline,
                                 .runtime = 1ms,
                                 .deadline = 10ms,
                                 .period = 10ms}};
  const std::vector<ModelledThread> bound{reserved, fifo(1, 80, {1}), fifo(2, 80, {1})};
  EXPECT_TRUE(find_places(bound, 3, {0, 1}, false)[0].reservation);
  EXPECT_THAT(find_places(bound, 3, {0, 1}, false)[1].unknown, HasSubstr("the same priority"));
  EXPECT_TRUE(find_places({bound.data(), 2}, 2, {0, 1}, false)[1].share);
  // A pool needs its CPUs.
  const std::vector<ModelledThread> pool{reserved, fifo(1, 80, {0}), fifo(1, 80, {1})};
  EXPECT_THAT(find_places(pool, 2, {0, 1}, false)[1].unknown, HasSubstr("share CPUs or have"));
}

// A band with fewer priorities than there are urgencies lets a callback wait for any other one.
TEST(SystemModel, KnowsTheBandOfAPreemptiveExecutor) {
  const auto bound = [](const char* band) {
    return bound_of(fmt::format(R"(
threads: {{urgent: {{policy: SCHED_FIFO, priority: {}, affinity: [0]}}}}
executors: {{fast: {{type: preemptive, threads: [urgent]}}}}
container:
  components:
    - {{component: takt::Workload, name: a, executor: fast, callbacks: {{x_timer: {{priority: 1}}}}, parameters: {{publishers: {{topic: [x], period_us: [100000], work_us: [9000]}}}}}}
    - {{component: takt::Workload, name: b, executor: fast, callbacks: {{w_timer: {{priority: 2}}}}, parameters: {{publishers: {{topic: [w], period_us: [100000], work_us: [2000]}}}}}}
    - {{component: takt::Workload, name: c, executor: fast, callbacks: {{z_timer: {{priority: 3}}}}, parameters: {{publishers: {{topic: [z], period_us: [100000], work_us: [1000]}}}}}}
chains: [{{name: c, path: [c/z_timer]}}]
)",
                                band))
        .bound;
  };
  EXPECT_EQ(bound("60..62"), 1ms);
  EXPECT_EQ(bound("60..61"), 1ms + 9ms - 1ns);
}

class ModelManaged : public LifecycleNode {
 public:
  explicit ModelManaged(const NodeOptions& options) : LifecycleNode("managed", options) {}
};

/// A timer of 1 ms, and a lifecycle node that has made nothing, on the same CPU.
std::string managed(const char* executor) {
  return fmt::format(R"(
realtime: require
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, other: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}}}
executors: {{default: {{type: events, threads: [one]}}, apart: {{type: events, threads: [other]}}}}
chains: [{{name: c, deadline: 5ms, path: [v/v_timer]}}]
container:
  components:
    - {{component: takt::Workload, name: v, executor: default, parameters: {{publishers: {{topic: [v], period_us: [10000], work_us: [1000]}}}}}}
    - {{component: 'takt::test::ModelManaged', name: x, executor: {}}}
)",
                     executor);
}

MeasuredModel run_of_managed() {
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/v/v_timer", .executions = 100, .longest_execution = 1ms});
  return measured;
}

TEST(SystemModel, ALifecycleNodeIsNotCoveredBeforeARunInWhichItWasActive) {
  const Analyzed found = analyzed(managed("default"), nullptr, /*accepts_all=*/true);
  EXPECT_EQ(found.verdict(), Verdict::not_covered);
  EXPECT_THAT(found.text_of("lifecycle"), HasSubstr("'/x' is a lifecycle node"));
  MeasuredModel measured = run_of_managed();
  EXPECT_EQ(verdict_of(managed("default"), &measured), Verdict::not_covered);
  measured.active_nodes = {"/x"};
  EXPECT_EQ(verdict_of(managed("default"), &measured), Verdict::guaranteed);
}

TEST(SystemModel, ARunHasShownACallbackOfANodeThatHasMadeNone) {
  MeasuredModel measured = run_of_managed();
  measured.active_nodes = {"/x"};
  measured.callbacks.push_back({.name = "/x/late", .executions = 100, .longest_execution = 1ms});
  EXPECT_EQ(verdict_of(managed("default"), &measured), Verdict::no_bound);
  // Its executor has no callback yet, so nobody knows whom it delays.
  const Analyzed apart = analyzed(managed("apart"), &measured, /*accepts_all=*/true);
  EXPECT_EQ(apart.verdict(), Verdict::not_covered);
  EXPECT_THAT(apart.text_of("callbacks"), HasSubstr("'/x/late' ran 100 times in the model"));
}

// A model of another system, or edited by hand, was guaranteed.
TEST(SystemModel, AModelThatContradictsItsSystemIsRefused) {
  MeasuredModel measured = measured_run({"/x/x_timer", "/y/x"});
  measured.path = "m.yaml";
  measured.lines = {{"/x/x_timer", "m.yaml:3"}, {"c", "m.yaml:9"}};
  const auto error = [&] {
    try {
      analyzed(two_processes("topics: {/x: {delay: 1ms}}\n"), &measured);
    } catch (const Error& thrown) {
      return std::string(thrown.what());
    }
    return std::string();
  };
  EXPECT_EQ(error(), "");
  measured.chains = {{.name = "c", .instances = 9}};
  EXPECT_EQ(error(), "");
  measured.chains[0].instances = 10;
  EXPECT_EQ(error(),
            "m.yaml:9: 'c' contradicts the system: 10 of its instances came through, and "
            "'/y/x' was executed 9 times; correct it, or measure this system");
  measured.chains = {{.name = "c", .instances = 9, .longest = 900us}};
  measured.callbacks[1].least_execution = 905us;
  EXPECT_EQ(error(), "");
  measured.callbacks[1].least_execution = 1ms;
  EXPECT_EQ(error(),
            "m.yaml:9: 'c' contradicts the system: its longest instance took 900us, and each "
            "execution of '/y/x' at least 1ms; correct it, or measure this system");
  measured.callbacks[1].least_execution = 0ns;
  measured.chains.clear();
  measured.callbacks[0].causes = {{"/x/x_timer", 1}};
  EXPECT_THAT(error(), HasSubstr("m.yaml:3: '/x/x_timer' contradicts the system: it 'causes' "
                                 "'/x/x_timer', a timer"));
  measured.callbacks[0].causes.clear();
  measured.callbacks[0].uncaused = 1;
  EXPECT_THAT(error(), HasSubstr("it is a timer, which has no executions that are 'uncaused'"));
}

// "/x" with the topic "t/u", and "/x/t" with "u".
TEST(SystemModel, ARunDoesNotTellCallbacksOfTwoNodesApart) {
  const std::string text = managed("default") + R"(
    - {component: takt::Workload, name: w, executor: default, parameters: {subscriptions: {topic: [t/u], work_us: [100]}}}
    - {component: takt::Workload, name: t, namespace: /w, executor: default, parameters: {subscriptions: {topic: [u], work_us: [100]}}}
)";
  MeasuredModel measured = run_of_managed();
  measured.active_nodes = {"/x"};
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
  measured.callbacks.push_back({.name = "/w/t/u", .executions = 100, .longest_execution = 100us});
  EXPECT_THAT([&] { verdict_of(text, &measured); },
              ::testing::ThrowsMessage<Error>(HasSubstr("'/w/t/u' is a callback of two nodes")));
}

TEST(SystemModel, AContainerRefusesABudgetThatExecutionsExceed) {
  const ConfigurationFile file("budget.yaml", managed("default"));
  Container container(file.read());
  container.change_parameters("{v: {callbacks: {v_timer: {budget: 2ms}}}}");
  EXPECT_THAT(
      [&] { container.change_parameters("{v: {callbacks: {v_timer: {budget: 500us}}}}"); },
      ::testing::ThrowsMessage<Error>(HasSubstr("chain 'c' could take longer than its bound (")));
}

// The executor sends what the last period has left before it serves the next one, and then its own.
TEST(SystemModel, APeriodBeginsWithItsSending) {
  const auto bound = [](const char* message) {
    return *bound_of(fmt::format(R"(
machine: {{overheads: {{dispatch: 0us, wake: 0us, switch: 0us, publish: {{message: {}, receiver: 0us}}}}}}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}}}
executors: {{e: {{type: triggered, let: 20ms, threads: [a]}}, f: {{type: events, threads: [b]}}}}
container:
  components:
    - {{component: takt::Workload, name: p, executor: e, parameters: {{publishers: {{topic: [x], period_us: [20000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: q, executor: f, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}}}
chains: [{{name: c, path: [p/x_timer]}}]
)",
                                 message))
                .bound;
  };
  EXPECT_EQ(bound("1ms") - bound("100us"), 2 * 900us);
}

// A deadline took time and memory in proportion to its length: 9 s for 1000 h, and more than there
// is.
TEST(SystemModel, ALongDeadlineIsNoWork) {
  for (const auto& [executor, priority] :
       {std::pair{"events", "50"}, std::pair{"preemptive", "60..62"}}) {
    const auto text = fmt::format(R"(
threads: {{a: {{policy: SCHED_FIFO, priority: {}, affinity: [0]}}}}
executors: {{e: {{type: {}, scheduler: edf, threads: [a]}}}}
container:
  components:
    - {{component: takt::Workload, name: p, executor: e, callbacks: {{x_timer: {{deadline: 100000h}}}}, parameters: {{publishers: {{topic: [x], period_us: [10000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: q, executor: e, callbacks: {{z_timer: {{deadline: 10ms}}}}, parameters: {{publishers: {{topic: [z], period_us: [10000], work_us: [2000]}}}}}}
chains: [{{name: c, path: [p/x_timer]}}]
)",
                                  priority, executor);
    EXPECT_TRUE(bound_of(text).bound) << executor;
  }
}

TEST(Ranks, AreTheSchedulersOrder) {
  std::vector<CallbackInfo> infos(3);
  for (CallbackId i = 0; i < 3; ++i) infos[i].id = i;
  infos[1].priority = 7;
  EXPECT_THAT(ranks_of(infos, "fixed_priority"), ElementsAre(1, 0, 1));
  EXPECT_THAT(ranks_of(infos, "fifo"), ElementsAre(0, 0, 0));
}

// Of three runs, each may end while two instances are on their way.
TEST(SystemModel, AllowsForWhatIsOnItsWayAtTheEndOfEachRun) {
  SystemModel::Chain chain{.begun = 150, .came_through = 145, .begun_a_second = 10};
  const ModelBounds::Chain bound{.bound = 1ms};
  EXPECT_NE(why_lost_in_run(chain, bound), "");
  chain.runs = 3;
  EXPECT_EQ(why_lost_in_run(chain, bound), "");
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::ModelManaged, "a lifecycle node")
