// What the code of a component may do, and no file tells: each is said, or takes the bound away.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/bound_of_test.hpp"
#include "takt/entities/task.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace tricky {
namespace {

using namespace takt;
using namespace takt::test;

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

struct Coded {
  int number = 0;
};
TAKT_MESSAGE(Coded, "test/msg/Coded", number);

/// Sends to `t` each 10 ms. It says that it takes 1 ms.
class CodeSender : public Node, public KnowsExecutionTimes {
 public:
  explicit CodeSender(const NodeOptions& options) : Node("sender", options) {
    publisher_ = create_publisher<Coded>("t", 10, {.published_by = {"tick"}});
    timer_ = create_timer("tick", 10ms, [] {});
  }
  std::optional<Nanoseconds> execution_time(std::string_view) const override { return 1ms; }

 private:
  Publisher<Coded>::SharedPtr publisher_;
  Timer::SharedPtr timer_;
};

/// Its parameter chooses how it receives.
class CodeReceiver : public Node {
 public:
  explicit CodeReceiver(const NodeOptions& options) : Node("receiver", options) {
    const auto kind = declare_parameter<std::string>("kind", "");
    const auto group = create_callback_group("own", CallbackGroupType::MutuallyExclusive,
                                             /*automatically_add_to_executor=*/kind != "apart");
    if (kind == "coroutine") {
      subscription_ = create_subscription<Coded>(
          "t", 10, [](const Coded&) -> Task<> { co_return; }, group);
    } else {
      subscription_ = create_subscription<Coded>(
          "t", 10, [](const Coded&) {}, group);
    }
  }

 private:
  std::shared_ptr<void> subscription_;
};

/// The same with a lifecycle. It says that it takes 1 ms, but not what it makes when configured.
class CodeManaged : public LifecycleNode, public KnowsExecutionTimes {
 public:
  explicit CodeManaged(const NodeOptions& options)
      : LifecycleNode("managed", options),
        subscription_(create_subscription<Coded>("t", 10, [](const Coded&) {})) {}
  std::optional<Nanoseconds> execution_time(std::string_view) const override { return 1ms; }

 private:
  std::shared_ptr<void> subscription_;
};

struct CodeFile {
  std::string top = {}, kind = {}, of_tick = {}, more = {}, sender = "tricky::CodeSender";

  Analyzed analyzed() const {
    return takt::test::analyzed("realtime: require\nmemory: {lock: true}\n" + top + R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}, two: {policy: SCHED_FIFO, priority: 40, affinity: [0]}}
executors: {default: {threads: [one], type: events}, other: {threads: [two], type: events}}
chains: [{name: c, deadline: 50ms, path: [s/tick, r/t]}]
container:
  name: coded
  components:
    - component: )" + sender + R"(
      name: s
      executor: default
      callbacks: {tick: {)" + of_tick +
                                R"(}}
    - component: tricky::CodeReceiver
      name: r
      executor: default
      parameters: {kind: ')" + kind +
                                R"('}
      callbacks: {t: {execution: 1ms}}
)" + more);
  }
};

// A class of somebody's that says its execution times was taken to do nothing else.
TEST(CodeTraps, AClassThatKnowsItsTimesMayDoMore) {
  const Analyzed found = CodeFile().analyzed();
  EXPECT_TRUE(found.bound().bound);
  EXPECT_THAT(found.text_of("as_declared"),
              AllOf(HasSubstr("'/s/tick' keeps its period"),
                    HasSubstr("'/s', '/r' makes no other callbacks later"),
                    HasSubstr("only 'tick' of '/s' send to '/r/t', and no thread that it has made"),
                    HasSubstr("execution of '/s/tick' sends one message to each topic")));
}

// Its name made it one of Takt's, which do nothing else.
TEST(CodeTraps, ANameDoesNotMakeAClassTakts) {
  EXPECT_EQ(CodeFile{.sender = "takt::CodeOfNamespace"}.analyzed().text_of("as_declared"),
            CodeFile().analyzed().text_of("as_declared"));
}

// The subscription of a topic without a known publisher took no time.
TEST(Keys, ANodeMaySendWhatNobodyKnows) {
  const std::string text = CodeFile().analyzed().text_of("as_declared");
  EXPECT_THAT(text, HasSubstr("'/s', '/r' makes no publisher later, and has no other node"));
  EXPECT_THAT(text, HasSubstr("'/s', '/r' starts no process"));
}

TEST(CodeTraps, AStepMaySendNothing) {
  EXPECT_THAT(CodeFile().analyzed().text_of("as_declared"), HasSubstr("no more and no less"));
}

TEST(CodeTraps, ASenderMaySendBeforeItsEnd) {
  const auto text = [](const char* of_tick) {
    return CodeFile{.of_tick = of_tick}.analyzed().text_of("as_declared");
  };
  EXPECT_EQ(CodeFile().analyzed().model.system.callbacks[0].least_execution, 0);
  EXPECT_THAT(text("execution: {min: 1ms, max: 1ms}"), HasSubstr("'/s/tick' sends at its end"));
  EXPECT_THAT(text("execution: {min: 1ms, max: 1ms}, outputs: any"), Not(HasSubstr("at its end")));
}

TEST(CodeTraps, AConstructorMayChooseTheFirstRelease) {
  EXPECT_THAT(CodeFile().analyzed().text_of("start_is_over"),
              HasSubstr("a first release of '/s/tick' that its constructor chooses"));
}

TEST(CodeTraps, ACallbackMayBeLetGoAndChanged) {
  EXPECT_THAT(CodeFile().analyzed().text_of("nothing_is_changed"),
              HasSubstr("'/s', '/r' lets none of its callbacks go, and changes no parameters"));
}

TEST(CodeTraps, ACoroutineGoesOnWhenItLikes) {
  EXPECT_THAT(CodeFile{.kind = "coroutine"}.analyzed().bound().why_not,
              HasSubstr("'/r/t' is a coroutine: nobody knows when it goes on"));
}

/// Works in batches, and controls between them.
class CodeInBatches : public Node {
 public:
  explicit CodeInBatches(const NodeOptions& options) : Node("planner", options) {
    const auto group = create_callback_group("work", CallbackGroupType::MutuallyExclusive);
    work_ = create_timer(
        "work", 1s, []() -> Task<> { co_await batch(); }, group);
    control_ = create_timer("control", 10ms, [] {});
  }

 private:
  Timer::SharedPtr work_, control_;
};

// Nobody knows how many batches there are: what comes before them waits for one.
TEST(CodeTraps, BatchesDelayWhatIsMoreUrgentByOne) {
  const auto bound = [](const char* scheduler, const char* of_work, const char* path) {
    return analyzed(fmt::format(R"(
machine: {{rt_runtime: 1s}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}}}
executors: {{one: {{threads: [one], type: events, scheduler: {}}}}}
chains: [{{name: c, path: [p/{}]}}]
container:
  components:
    - component: tricky::CodeInBatches
      name: p
      executor: one
      callback_groups: {{work: {{{}}}}}
      callbacks: {{control: {{execution: 1ms, priority: 0}}}}
)",
                                scheduler, path, of_work))
        .bound();
  };
  EXPECT_EQ(bound("fixed_priority", "priority: -1, budget: 2ms", "control").bound, 3ms);
  EXPECT_FALSE(bound("fixed_priority", "priority: 1, budget: 2ms", "control").bound);
  EXPECT_FALSE(bound("fifo", "budget: 2ms", "control").bound);
  EXPECT_THAT(bound("fixed_priority", "priority: -1", "control").why_not,
              HasSubstr("the execution time of '/p/work/resumed/alarm' is not known"));
  EXPECT_THAT(bound("fixed_priority", "priority: -1, budget: 2ms", "work").why_not,
              HasSubstr("'/p/work' is a coroutine"));
}

/// Sends when it likes, as takt::Player sends when its recording has a message.
class CodeAlarm : public Node, public SetsReleases {
 public:
  explicit CodeAlarm(const NodeOptions& options)
      : Node("alarm", options), timer_(create_timer("play", 500ms, [] {})) {}

 private:
  Timer::SharedPtr timer_;
};

// Its first delay was taken for the period of what it sends.
TEST(Keys, APeriodSaysNothingWhereTheCodeSetsReleases) {
  const auto bound = [](const char* arrival, const MeasuredModel* measured = nullptr) {
    return bound_of(fmt::format(R"(
machine: {{rt_runtime: 1s}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}}}
executors: {{one: {{threads: [one], type: events}}}}
chains: [{{name: c, path: [p/play]}}]
container:
  components:
    - component: tricky::CodeAlarm
      name: p
      executor: one
      callbacks: {{play: {{execution: 1ms{}}}}}
)",
                                arrival),
                    measured);
  };
  EXPECT_THAT(bound("").why_not, HasSubstr("it is not known how often '/p/play' runs"));
  EXPECT_EQ(bound(", arrival: {distances: [0ns, 10ms]}").bound, 2ms);
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/p/play",
                                .executions = 3,
                                .longest_execution = 1ms,
                                .least_distances = {0ms, 0ms, 100ms}});
  EXPECT_EQ(bound("", &measured).bound, 3ms);
}

/// Two timers in a reentrant group.
class CodeSeveral : public Node {
 public:
  explicit CodeSeveral(const NodeOptions& options) : Node("several", options) {
    const auto group = create_callback_group("several", CallbackGroupType::Reentrant);
    for (const char* name : {"a", "b"})
      timers_.push_back(create_timer(
          name, 10ms, [] {}, group));
  }

 private:
  std::vector<Timer::SharedPtr> timers_;
};

// Only the nodes say how many groups there are.
TEST(Keys, AllReservationsOfIsolatedGroupsTogetherAreAdmitted) {
  const auto analyzed_with = [](int threads) {
    return analyzed(fmt::format(R"(
machine: {{cpus: 2, rt_runtime: 950ms}}
threads: {{any: {{policy: SCHED_DEADLINE, runtime: 4900us, period: 10ms}}}}
executors: {{default: {{type: isolated, per: group, threads: [any], reentrant_threads: {}}}}}
container: {{components: [{{component: tricky::CodeSeveral, name: s, executor: default}}]}}
)",
                                threads));
  };
  EXPECT_NO_THROW(analyzed_with(3));
  EXPECT_THAT([&] { analyzed_with(4); },
              testing::ThrowsMessage<Error>(
                  HasSubstr("system.yaml: SCHED_DEADLINE threads reserve 1.96 CPUs, of 1.9")));
}

TEST(Keys, AReentrantGroupOfIsolatedMayHaveSeveralThreads) {
  const auto analyzed_with = [](const char* keys, const char* of_chain = "") {
    return analyzed(fmt::format(R"(
machine: {{cpus: 2, rt_runtime: 1s}}
threads: {{any: {{policy: SCHED_FIFO, priority: 50, affinity: [0, 1]}}}}
executors: {{default: {{type: isolated, per: group, threads: [any]{}}}}}
chains: [{{name: c, path: [s/a]{}}}]
container:
  components:
    - component: tricky::CodeSeveral
      name: s
      executor: default
      callbacks: {{a: {{execution: 1ms}}, b: {{execution: 1ms}}}}
)",
                                keys, of_chain));
  };
  const Analyzed one = analyzed_with(""), two = analyzed_with(", reentrant_threads: 2");
  EXPECT_EQ(one.model.system.executors[0].threads, 1u);
  EXPECT_EQ(two.model.system.executors[0].threads, 2u);
  EXPECT_EQ(one.bound().bound, 2ms);
  EXPECT_EQ(two.bound().bound, 2ms);
  EXPECT_THAT(analyzed_with(", reentrant_threads: 2", ", concurrency: 1").bound().why_not,
              HasSubstr("no method knows the `concurrency` of a chain"));
}

// The group that a component keeps for an executor of its own was analysed as one of the file's.
TEST(CodeTraps, AGroupMayBelongToNoExecutorOfTheFile) {
  EXPECT_EQ(CodeFile{.kind = "plain"}.analyzed().bound().why_not, "");
  EXPECT_THAT(CodeFile{.kind = "apart"}.analyzed().bound().why_not,
              HasSubstr("no executor of the file runs the group 'own' of '/r/t'"));
}

// A less urgent thread holds the heap's lock as long as Linux lets it wait.
TEST(CodeTraps, TheHeapHasALock) {
  const auto text = [](const char* way) {
    return analyzed(fmt::format(R"(
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, two: {{policy: SCHED_FIFO, priority: 40, affinity: [0]}}}}
executors: {{a: {{threads: [one], type: events}}, b: {{threads: [two], type: events}}}}
container:
  components:
    - {{component: takt::Workload, name: a, executor: a, parameters: {{publishers: {{topic: [w], period_us: [10000]}}}}}}
    - {{component: takt::Workload, name: b, executor: b, parameters: {{publishers: {{topic: [x], period_us: [10000], pass_by: [{}]}}}}}}
chains: [{{name: c, path: [a/w_timer]}}]
)",
                                way))
        .text_of("as_declared");
  };
  EXPECT_THAT(text("unique_ptr"),
              HasSubstr("'/a/w_timer', '/b/x_timer' waits for the heap's lock"));
  EXPECT_EQ(text("loaned_msg"), "");
}

// What a second subscription costs who sends was nothing.
TEST(Keys, AMessageGoesToEachSubscription) {
  const auto found = [](const char* publish) {
    return analyzed(fmt::format(R"(
machine: {{cpus: [0, 1], rt_runtime: 1s, overheads: {{dispatch: 1us, wake: 1us, switch: 1us, publish: {}}}}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, two: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}}}
executors: {{a: {{threads: [one], type: events}}, b: {{threads: [two], type: events}}}}
container:
  components:
    - {{component: takt::Workload, name: a, executor: a, parameters: {{publishers: {{topic: [w], period_us: [10000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: b, executor: b, parameters: {{subscriptions: {{topic: [w, w, w], work_us: [1, 1, 1]}}}}}}
chains: [{{name: c, path: [a/w_timer]}}]
)",
                                publish));
  };
  const Nanoseconds one = found("10us").bound().bound.value();
  EXPECT_EQ(found("{message: 10us, receiver: 5us}").bound().bound, one + 2 * 5us);
  EXPECT_THAT(found("10us").text_of("overheads_are_zero"), HasSubstr("to a second subscription"));
  EXPECT_EQ(found("{message: 10us, receiver: 5us}").text_of("overheads_are_zero"), "");
}

// Reading 8 MB of another process was no work, and delayed a chain that has nothing to do with it.
TEST(CodeTraps, TakingAMessageOfAnotherProcessIsWork) {
  const auto found = [](const std::string& overheads, const std::string& more = {}) {
    std::string text = two_processes("topics: {/x: {delay: {max: 1ms}}}\n");
    const auto replace = [&](std::string_view what, const std::string& with) {
      text.replace(text.find(what), what.size(), with);
    };
    replace("cpus: [0, 1]", "cpus: [0, 1]" + overheads);
    replace("period_us: [20000]", "period_us: [20000], size_bytes: [2000000]");
    replace("subscriptions: {topic: [x], work_us: [100]}}",
            "subscriptions: {topic: [x], work_us: [100]}}" + more);
    return analyzed(text);
  };
  const std::string publish = ", overheads: {publish: {message: 10us, megabyte: 1ms}}";
  const auto taken = found(publish);
  EXPECT_EQ(taken.model.system.callbacks.at(1).execution, 2'110'000);
  EXPECT_EQ(taken.text_of("overheads_are_zero").find("taking"), std::string::npos);
  EXPECT_THAT(found("").text_of("overheads_are_zero"),
              HasSubstr("taking a message of another process"));
  EXPECT_THAT(found(publish, ", callbacks: {x: {budget: 5ms}}").text_of("overheads_are_zero"),
              HasSubstr("taking a message of another process"));
}

// Of a topic, a gibibyte of messages from other processes may wait.
TEST(CodeTraps, LargeMessagesThatWaitAreLost) {
  const auto lossy = [](int megabytes) {
    std::string text = two_processes("topics: {/x: {delay: {max: 10s}}}\n");
    const std::string_view period = "period_us: [20000]";
    text.replace(text.find(period), period.size(),
                 fmt::format("period_us: [20000], size_bytes: [{}000000]", megabytes));
    const std::string_view topic = "{topic: [x], work_us: [100]}";
    text.replace(text.find(topic), topic.size(), "{topic: [x], work_us: [100], depth: [1000]}");
    return analyzed(text).bounds.chains.at(0).why_lossy;
  };
  EXPECT_THAT(lossy(8), HasSubstr("have a gibibyte"));
  EXPECT_THAT(lossy(1), HasSubstr("may be overwritten"));  // half of one wait
}

// Of more than sixteen chains that joins continue as one, the others end there.
TEST(CodeTraps, JoinsContinueSixteenChains) {
  const auto why_not = [](int each) {
    std::string text = "container:\n  components:\n", chains;
    const auto add = [&](const char* name, const std::string& parameters) {
      text += fmt::format("    - {{component: takt::Workload, name: {}, parameters: {{{}}}}}\n",
                          name, parameters);
    };
    for (const char* join : {"j", "k"}) {
      std::string inputs, outputs, periods;
      for (int i = 0; i < each; ++i) {
        inputs += fmt::format("{}{}{}", i > 0 ? ", " : "", join, i);
        outputs += fmt::format("{}o{}", i > 0 ? ", " : "", join);
        periods += i > 0 ? ", 20000" : "20000";
        chains += fmt::format(
            "  - {{name: {0}{1}, path: [s{0}/{0}{1}_timer, {0}/{0}{1}, m/o{0}, w/o]}}\n", join, i);
      }
      add(fmt::format("s{}", join).c_str(),
          fmt::format("publishers: {{topic: [{}], period_us: [{}]}}", inputs, periods));
      add(join, fmt::format("relays: {{input: [{}], output: [{}]}}", inputs, outputs));
    }
    add("m", "relays: {input: [oj, ok], output: [o, o]}");
    add("w", "subscriptions: {topic: [o]}");
    return analyzed(text + "chains:\n" + chains).chain().why_not;
  };
  EXPECT_EQ(why_not(8), "");
  EXPECT_THAT(why_not(9), HasSubstr("18 chains go through the join before '/w/o', and 16"));
}

// Waking forty threads was in no execution, as a run had measured all on one.
TEST(CodeTraps, AModelOfOneExecutorSaysWhatItLacks) {
  const auto text = [](const char* of_receiver, bool is_caused = true) {
    MeasuredModel measured{.path = "m.yaml", .duration = 10s};
    measured.executors = {{"a", "events", "fifo", {"/x/x_timer"}}};
    measured.executors.push_back({of_receiver, "events", "fifo", {"/y/x"}});
    for (const char* name : {"/x/x_timer", "/y/x"}) {
      measured.callbacks.push_back(
          {.name = name, .executions = 9, .longest_execution = 1ms, .least_distances = {10ms}});
    }
    if (is_caused) measured.callbacks[0].causes = {{"/y/x", 1}};
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, affinity: [1]}}
executors: {a: {type: events, threads: [a]}, b: {type: events, threads: [b]}}
container:
  components:
    - {component: takt::Workload, name: x, executor: a, parameters: {publishers: {topic: [x], period_us: [50000]}}}
    - {component: takt::Workload, name: y, executor: b, parameters: {subscriptions: {topic: [x]}}}
chains: [{name: c, path: [x/x_timer, y/x]}]
)",
                    &measured)
        .text_of("as_measured");
  };
  EXPECT_THAT(text("a"), HasSubstr("'/x/x_timer' takes as long to wake other executors"));
  EXPECT_EQ(text("b").find("to wake other executors"), std::string::npos);
  // What nothing has caused is `uncaused`.
  EXPECT_THAT([&] { text("b", /*is_caused=*/false); },
              ThrowsMessage<Error>(HasSubstr("9 of its executions have a cause, but nothing")));
}

TEST(CodeTraps, ALifecycleNodeThatKnowsItsTimesMayMakeMore) {
  EXPECT_EQ(verdict_of(R"(
realtime: require
lifecycle: {bring_up: [y]}
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
executors: {a: {type: events, threads: [a]}}
container:
  components:
    - {component: tricky::CodeSender, name: x, executor: a}
    - {component: tricky::CodeManaged, name: y, executor: a}
chains: [{name: c, deadline: 50ms, path: [x/tick, y/t]}]
)"),
            Verdict::not_covered);
}

// A process that starts again sends its start's burst to another one, in the middle of a run.
TEST(CodeTraps, NoProcessStartsAgain) {
  const auto text = [](const char* restart) {
    std::string file = two_processes("topics: {/x: {delay: {max: 1ms}}}\n");
    const std::string_view name = "name: p1, ";
    file.replace(file.find(name), name.size(), std::string(name) + restart);
    return analyzed(file).text_of("nothing_is_changed");
  };
  EXPECT_THAT(text("restart: {policy: on_failure}, "),
              HasSubstr("no process ends, or starts again"));
  EXPECT_THAT(text(""), HasSubstr("no process ends before the others"));
  EXPECT_EQ(text("").find("starts again"), std::string::npos);
}

// The advice was a path that is an error.
TEST(CodeTraps, AChainBeginsBehindAService) {
  EXPECT_THAT(analyzed(R"(
executors: {default: {type: events}}
container:
  components:
    - {component: takt::Workload, name: a, executor: default, parameters: {clients: {service: [s], period_us: [10000]}}}
    - {component: takt::Workload, name: b, executor: default, parameters: {servers: {service: [s]}}}
chains: [{name: c, path: [b/s]}]
)")
                  .bound()
                  .why_not,
              HasSubstr("begin the path behind 'b/s'"));
}

}  // namespace
}  // namespace tricky

namespace takt {
class CodeOfNamespace : public tricky::CodeSender {
 public:
  using CodeSender::CodeSender;
};
}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::CodeOfNamespace, "sends, and is not of Takt")
TAKT_REGISTER_COMPONENT(tricky::CodeSender, "sends")
TAKT_REGISTER_COMPONENT(tricky::CodeReceiver, "receives")
TAKT_REGISTER_COMPONENT(tricky::CodeManaged, "receives when it is active")
TAKT_REGISTER_COMPONENT(tricky::CodeAlarm, "sends when it likes")
TAKT_REGISTER_COMPONENT(tricky::CodeSeveral, "has a reentrant group")
TAKT_REGISTER_COMPONENT(tricky::CodeInBatches, "works in batches")
