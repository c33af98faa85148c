// Systems that look as if they were in order: none of them may be called guaranteed.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/bound_of_test.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

struct Trapped {
  int number = 0;
};
TAKT_MESSAGE(Trapped, "test/msg/Trapped", number);

struct TrapBefore {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return a.info->priority > b.info->priority;
  }
};
using TrapClaims = HeapScheduler<TrapBefore>;

/// Has no callbacks.
class TrapEmpty : public Node {
 public:
  explicit TrapEmpty(const NodeOptions& options) : Node("empty", options) {}
};

/// Sends to `t` each 10 ms, in ways that its parameters choose.
class TrapSender : public Node {
 public:
  explicit TrapSender(const NodeOptions& options) : Node("sender", options) {
    const auto lifespan_us = declare_parameter<std::int64_t>("lifespan_us", 0);
    const auto loans = declare_parameter<std::int64_t>("loans", 0);
    const auto topics = declare_parameter<std::int64_t>("topics", 1);
    const bool is_reliable = declare_parameter<bool>("reliable", true);
    QoS qos(10);
    qos.lifespan(std::chrono::microseconds(lifespan_us));
    if (!is_reliable) qos.best_effort();
    for (std::int64_t i = 0; i < topics; ++i) {
      publishers_.push_back(create_publisher<Trapped>(
          i == 0 ? "t" : fmt::format("t{}", i), qos,
          {.loans = static_cast<std::size_t>(loans), .published_by = {"tick"}}));
    }
    timer_ = create_timer("tick", 10ms, [] {});
    const auto handles = declare_parameter<std::string>("handles", "");
    const auto handler = [](const OverrunReport&) {};
    if (handles == "deadline") {
      set_callback_parameters({.callbacks = {{"tick", {.on_deadline_miss = handler}}}});
    } else if (handles == "overrun") {
      set_callback_parameters({.callbacks = {{"tick", {.on_overrun = handler}}}});
    }
  }

 private:
  std::vector<Publisher<Trapped>::SharedPtr> publishers_;
  Timer::SharedPtr timer_;
};

/// Asks for what the parameter names, besides.
class TrapReceiver : public Node {
 public:
  explicit TrapReceiver(const NodeOptions& options) : Node("receiver", options) {
    const auto asks = declare_parameter<std::string>("asks", "");
    QoS qos(10);
    if (asks == "durability") qos.transient_local();
    if (asks == "deadline") qos.deadline(1s);
    if (asks == "liveliness") qos.liveliness(Liveliness::manual_by_topic);
    if (asks == "lease_duration") qos.liveliness_lease_duration(1s);
    subscription_ = create_subscription<Trapped>("t", qos, [](const Trapped&) {});
  }

 private:
  std::shared_ptr<void> subscription_;
};

/// Something triggers it.
class TrapTriggered : public Node {
 public:
  explicit TrapTriggered(const NodeOptions& options)
      : Node("triggered", options), condition_(create_guard_condition("t", [] {})) {}

 private:
  GuardCondition::SharedPtr condition_;
};

/// The same with a lifecycle.
class TrapManaged : public LifecycleNode {
 public:
  explicit TrapManaged(const NodeOptions& options)
      : LifecycleNode("managed", options),
        subscription_(create_subscription<Trapped>("t", 10, [](const Trapped&) {})) {}

 private:
  std::shared_ptr<void> subscription_;
};

/// Says that it sends to `t` once for a message of each of its topics.
class TrapJoiner : public Node {
 public:
  explicit TrapJoiner(const NodeOptions& options) : Node("joiner", options) {
    publisher_ = create_publisher<Trapped>("t", 10, {.published_by = {"a", "b"}, .joins = true});
    a_ = create_subscription<Trapped>("a", 10, [](const Trapped&) {});
    b_ = create_subscription<Trapped>("b", 10, [](const Trapped&) {});
  }

 private:
  Publisher<Trapped>::SharedPtr publisher_;
  std::shared_ptr<void> a_, b_;
};

/// A sender of 100 us and a receiver of 1 ms on one thread, and what else somebody writes.
struct TrapFile {
  std::string top, sender, tick, receiver = "takt::test::TrapReceiver", executor,
                                 path = "s/tick, r/t";

  std::string text() const {
    return "realtime: require\n" + top + R"(
threads: {main_cpu: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {threads: [main_cpu], )" +
           (executor.empty() ? "type: events" : executor) + R"(}}
chains: [{name: c, deadline: 50ms, path: [)" +
           path + R"(]}]
container:
  name: trapped
  components:
    - component: takt::test::TrapSender
      name: s
      executor: default
      parameters: {)" +
           sender + R"(}
      callbacks: {tick: {execution: 100us)" +
           tick + R"(}}
    - component: )" +
           receiver + R"(
      name: r
      executor: default
      callbacks: {t: {execution: 1ms}}
)";
  }
  Analyzed analyzed(const MeasuredModel* measured = nullptr) const {
    return test::analyzed(text(), measured, /*accepts_all=*/true);
  }
};

TEST(Traps, TheOneWithoutATrapIsGuaranteed) {
  EXPECT_EQ(TrapFile().analyzed().verdict(), Verdict::guaranteed);
}

// `isolated` has a thread for each node, and the model had one for each that has callbacks: 'y'
// was guaranteed the thread of 'e', which is more urgent than its own.
TEST(Traps, ANodeWithoutCallbacksHasAThread) {
  const auto bound = [](const char* before) {
    return *bound_of(fmt::format(R"(
threads:
  hot: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}
  mid: {{policy: SCHED_FIFO, priority: 55, affinity: [0]}}
  cold: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors:
  apart: {{type: isolated, threads: [hot, cold]}}
  other: {{type: events, threads: [mid]}}
chains: [{{name: c, path: [y/y_timer]}}]
container:
  name: isolated_trap
  components:
    {}
    - component: takt::Workload
      name: y
      executor: apart
      parameters: {{publishers: {{topic: ["y"], period_us: [10000], work_us: [1000]}}}}
    - component: takt::Workload
      name: x
      executor: other
      parameters: {{publishers: {{topic: [x], period_us: [10000], work_us: [2000]}}}}
)",
                                 before))
                .bound;
  };
  EXPECT_EQ(bound(""), 1ms);
  EXPECT_EQ(bound("- {component: 'takt::test::TrapEmpty', name: e, executor: apart}"), 3ms);
}

// A publisher with two messages sends nothing while both wait: no queue overflows.
TEST(Traps, ALentMessageMayBeOut) {
  TrapFile file{.sender = "loans: 4"};
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  EXPECT_THAT(file.analyzed().text_of("as_declared"), HasSubstr("keeps no message"));
  file.sender = "loans: 1";
  const Analyzed found = file.analyzed();
  EXPECT_EQ(found.verdict(), Verdict::may_lose);
  EXPECT_THAT(found.bound().why_lossy, HasSubstr("lends 1 message, and"));
}

// 256 of them wait for the end of a period of logical execution time; the rest was dropped.
TEST(Traps, APeriodHasRoomForSoMany) {
  TrapFile file{.sender = "topics: 256", .executor = "type: triggered, let: 10ms"};
  EXPECT_TRUE(file.analyzed().bound().bound);
  file.sender = "topics: 257";
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("257 messages in a period"));
}

// That of the file was read, and that of the code was not.
TEST(Traps, ALifespanOfTheCodeCounts) {
  TrapFile file{.sender = "lifespan_us: 500000"};
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.sender = "lifespan_us: 1";
  EXPECT_EQ(file.analyzed().verdict(), Verdict::may_lose);
}

TEST(Traps, NothingPassesWhereLessIsOfferedThanAskedFor) {
  const TrapFile file{.sender = "reliable: false"};
  EXPECT_THAT(file.analyzed().bound().why_not,
              HasSubstr("'/s' on '/t' offers less than '/r/t' asks for: reliability"));
  for (const char* policy : {"durability", "deadline", "liveliness", "lease_duration"}) {
    TrapFile asking;
    asking.receiver += fmt::format("\n      parameters: {{asks: {}}}", policy);
    EXPECT_THAT(asking.analyzed().bound().why_not, HasSubstr(policy));
  }
}

TEST(Traps, NothingComesToANodeThatNobodyBringsUp) {
  TrapFile file{.receiver = "takt::test::TrapManaged"};
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("nobody brings '/r' up"));
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/s/tick",
                                .executions = 1000,
                                .longest_execution = 100us,
                                .least_distances = {10ms},
                                .causes = {{"/r/t", 1}}});
  measured.callbacks.push_back(
      {.name = "/r/t", .executions = 1000, .longest_execution = 1ms, .least_distances = {9ms}});
  EXPECT_THAT(file.analyzed(&measured).text_of("brought_up_by_others"),
              HasSubstr("somebody brings the node of '/r/t' up"));
  file.top = "lifecycle: {bring_up: [r]}\n";
  EXPECT_TRUE(file.analyzed().bound().bound);
  // A run in which it was not.
  measured.callbacks[1] = {.name = "/r/t"};
  EXPECT_THAT(file.analyzed(&measured).bound().why_not, HasSubstr("did not run"));
}

TEST(Traps, NothingComesWhereNobodySends) {
  TrapFile file{.path = "r/t"};
  EXPECT_THAT(file.analyzed().bound().why_not,
              HasSubstr("comes from '/s/tick' in the same process, so no instance begins there"));
  file.receiver = "takt::test::TrapReceiver\n      remap: {t: nobody}";
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("nothing comes to '/r/t'"));
}

// A run would wait for each of them to find the other.
TEST(Traps, ProcessesThatDoNotFindEachOtherShareNoTopic) {
  const auto found = [](const char* discovery, const char* topic = "/x") {
    return analyzed(two_processes(fmt::format("dds: {{discovery: \"{}\"}}\n"
                                              "topics: {{{}: {{delay: {{max: 1ms}}}}}}\n",
                                              discovery, topic)))
        .bound();
  };
  EXPECT_TRUE(found("localhost").bound);
  EXPECT_THAT([&] { found("off"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("on '/x', and their processes do not find each "
                                                   "other: `discovery: off`"),
                                         HasSubstr("system.yaml:"))));
  // What is written for no topic, sets nothing.
  EXPECT_THAT([&] { found("localhost", "/X"); },
              ThrowsMessage<Error>(HasSubstr("no component has the topic or service '/X'")));
}

// A run that is refused its priorities goes on, unless the file requires them.
TEST(Traps, PrioritiesThatMayBeRefusedAreAssumed) {
  std::string text = TrapFile().text();
  EXPECT_EQ(analyzed(text).assumption("realtime_granted")->state, Assumption::State::checked);
  text.replace(text.find("require"), 7, "prefer");
  EXPECT_EQ(analyzed(text).assumption("realtime_granted")->state, Assumption::State::unchecked);
}

// 1.1 ms were guaranteed, and each execution was followed by a handler of 20 ms.
TEST(Traps, AHandlerTakesTimeWhereItMayRun) {
  TrapFile file{.sender = "handles: deadline", .tick = ", deadline: 5ms"};
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.tick = ", deadline: 500us";  // the receiver, which takes 1 ms, may have begun
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("then a handler of its code runs"));
  file.sender = "handles: overrun";
  EXPECT_EQ(file.analyzed().verdict(), Verdict::guaranteed);
  file.tick = ", budget: 500us";
  EXPECT_THAT(file.analyzed().bound().why_not, HasSubstr("'/s/tick' may take longer than 500us"));
}

// A lock that is refused was one: a run that only prefers it goes on.
TEST(Traps, ALockMayBeRefused) {
  std::string text = "memory: {lock: true}\n" + TrapFile().text();
  EXPECT_EQ(analyzed(text).assumption("no_page_faults"), nullptr);
  text.replace(text.find("require"), 7, "prefer");
  EXPECT_THAT(analyzed(text).text_of("no_page_faults"), HasSubstr("may refuse"));
}

// `published_by` was believed, and a thread of a component sends when it likes.
TEST(Traps, WhoSendsIsWhatTheCodeSays) {
  EXPECT_THAT(TrapFile().analyzed().text_of("as_declared"),
              HasSubstr("only 'tick' of '/s' send to '/r/t', and no thread that it has made"));
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/r/t",
                                .executions = 1000,
                                .longest_execution = 1ms,
                                .uncaused = 1000,
                                .uncaused_distances = {9ms}});
  EXPECT_THAT(TrapFile().analyzed(&measured).text_of("as_declared"), Not(HasSubstr("only 'tick'")));
}

/// `a` and `b` each 10 ms, the joiner, and who gets what that sends.
Analyzed joined(std::uint64_t received, std::size_t at_once) {
  MeasuredModel measured{.duration = 10s};
  for (const char* name : {"/a/tick", "/b/tick", "/j/a", "/j/b", "/r/t"}) {
    MeasuredCallback& seen = measured.callbacks.emplace_back();
    seen.name = name;
    seen.executions = 1000;
    seen.longest_execution = 100us;
    seen.least_distances = {10ms};
  }
  measured.callbacks[0].causes = {{"/j/a", 1}};
  measured.callbacks[1].causes = {{"/j/b", 1}};
  measured.callbacks[3].causes = {{"/r/t", at_once}};
  measured.callbacks[4].executions = received;
  measured.callbacks[4].least_distances = {0ms, 10ms};
  return analyzed(R"(
realtime: require
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, deadline: 50ms, losses: allowed, path: [b/tick, j/b, r/t]}]
container:
  name: joined
  components:
    - {component: 'takt::test::TrapSender', name: a, executor: default, remap: {t: a}}
    - {component: 'takt::test::TrapSender', name: b, executor: default, remap: {t: b}}
    - {component: 'takt::test::TrapJoiner', name: j, executor: default}
    - {component: 'takt::test::TrapReceiver', name: r, executor: default}
)",
                  &measured, /*accepts_all=*/true);
}

// One message for both inputs was believed, whatever a run had shown.
TEST(Traps, AJoinSendsWhatARunHasShown) {
  const Analyzed one = joined(1000, 1);
  EXPECT_EQ(one.verdict(), Verdict::guaranteed);
  EXPECT_GT(*joined(1000, 3).bound().bound, *one.bound().bound);  // three at once
  EXPECT_GT(*joined(2000, 1).bound().bound, *one.bound().bound);  // one for each input
}

// It begins when its first message is sent, in another process or outside of the file.
TEST(Traps, AChainThatBeginsWithAMessageHasItsDelay) {
  const auto bound = [](const std::string& top) {
    std::string text = two_processes("realtime: require\n" + top);
    text.replace(text.find("x/x_timer, y/x"), 14, "y/x");
    return analyzed(text, nullptr, /*accepts_all=*/true).bound();
  };
  EXPECT_FALSE(bound("").bound);
  ASSERT_TRUE(bound("topics: {/x: {delay: {max: 50ms}}}\n").bound);
  EXPECT_GT(*bound("topics: {/x: {delay: {max: 50ms}}}\n").bound, 50ms);
  EXPECT_EQ(*bound("topics: {/x: {delay: {max: 70ms}}}\n").bound -
                *bound("topics: {/x: {delay: {max: 60ms}}}\n").bound,
            10ms);
  TrapFile outside{.path = "r/t"};
  std::string text = outside.text();
  text.replace(text.find("t: {execution: 1ms}"), 19,
               "t: {execution: 1ms, arrival: {period: 20ms}}");
  text.erase(text.find("    - component: takt::test::TrapSender"),
             text.find("    - component: takt::test::TrapReceiver") -
                 text.find("    - component: takt::test::TrapSender"));
  EXPECT_THAT(analyzed(text).text_of("as_declared"), HasSubstr("has no `delay`"));
}

// Names of CPUs that another process has, and of CPUs that are not here.
TEST(Traps, CpusAreNamedOnceAndAreHere) {
  const auto error = [](const std::string& top) {
    try {
      TrapFile{.top = top}.analyzed();
    } catch (const Error& refused) {
      return std::string(refused.what());
    }
    return std::string();
  };
  EXPECT_THAT(error("machine: {cpus: [0, 0]}"), HasSubstr("CPU 0 is in the list twice"));
  const std::string more = "machine: {cpus: 1024}";
  EXPECT_THAT(TrapFile{.top = more}.analyzed().text_of("as_declared"),
              Not(HasSubstr("may use the CPUs")));  // its thread has one
  std::string text = TrapFile{.top = more}.text();
  text.replace(text.find(", affinity: [0]"), 15, "");
  EXPECT_THAT(analyzed(text).text_of("as_declared"), HasSubstr("may use the CPUs 0, 1, 2"));
}

// A scheduler of somebody else's may order otherwise than its traits say.
TEST(Traps, AnOrderIsClaimedByItsLibrary) {
  const auto text = [](const char* scheduler) {
    return TrapFile{.executor = fmt::format("type: events, scheduler: {}", scheduler)}
        .analyzed()
        .text_of("as_declared");
  };
  EXPECT_THAT(text("trap_claims"),
              HasSubstr("scheduler 'trap_claims' always orders as its traits"));
  EXPECT_THAT(text("fixed_priority"), Not(HasSubstr("orders as its traits")));
}

// By its own key it may hold a callback back, whatever its order.
TEST(Traps, AnArbitraryOrderRunsWhatWaits) {
  const auto found = [](const char* key) {
    return TrapFile{.top = fmt::format("schedulers: {{also_good: {{library: {}{}}}}}\n",
                                       TAKT_TEST_SCHEDULERS, key),
                    .executor = "type: events, scheduler: also_good"}
        .analyzed();
  };
  EXPECT_THAT(found("").text_of("as_declared"),
              HasSubstr("scheduler 'also_good' always has a callback to run while one waits"));
  EXPECT_NE(found("").verdict(), Verdict::not_covered);
  EXPECT_EQ(found(", q: 5ms").verdict(), Verdict::not_covered);
}

// What triggers a guard condition twice before it runs is served once.
TEST(Traps, TriggersMayBeServedAtOnce) {
  const auto why_lossy = [](const char* distances) {
    TrapFile file{.receiver = "takt::test::TrapTriggered", .path = "r/t"};
    std::string text = file.text();
    text.replace(text.find("t: {execution: 1ms}"), 19,
                 fmt::format("t: {{execution: 1ms, arrival: {{distances: [{}]}}}}", distances));
    return analyzed(text).bound().why_lossy;
  };
  EXPECT_EQ(why_lossy("20ms"), "");
  EXPECT_THAT(why_lossy("0ms, 20ms"), HasSubstr("2 triggers are served at once"));
}

// Two joins of a node counted as one, which sends when the inputs of both have come.
TEST(Traps, TwoJoinsSendMoreThanOne) {
  Node node("two");
  const auto joins = [&](std::vector<std::string> inputs) {
    return node.create_publisher<Trapped>("j", 10,
                                          {.published_by = std::move(inputs), .joins = true});
  };
  const auto first = joins({"a", "b"}), again = joins({"a", "b"});
  EXPECT_TRUE(node.publishing_callbacks("/j")->joins);
  const auto second = joins({"c", "d"});
  EXPECT_FALSE(node.publishing_callbacks("/j")->joins);
}

// A depth of 1000 was one of 256, if messages came by shared memory.
TEST(Traps, SharedMemoryHasAQueueOfItsOwn) {
  const auto depth = [](const char* shared) {
    return analyzed(two_processes(fmt::format("dds: {{shared_memory: {}}}\n"
                                              "topics: {{/x: {{depth: 1000, delay: {{max: "
                                              "1ms}}}}}}\n",
                                              shared)))
        .model.callbacks[1]
        .depth;
  };
  EXPECT_EQ(depth("'off'"), 1000u);
  EXPECT_EQ(depth("auto"), kMostQueued);
}

// What is unloaded, or deactivated, ends the chains that go through it.
TEST(Traps, AnActiveNodeMayBeDeactivated) {
  TrapFile file{.top = "dds: {discovery: localhost}\nlifecycle: {bring_up: [r]}\n",
                .receiver = "takt::test::TrapManaged"};
  EXPECT_THAT(file.analyzed().text_of("nothing_is_changed"),
              HasSubstr("the node of '/r/t' stays active"));
  // Its own file does it, also where nobody else is heard.
  const auto closed = [](const char* lifecycle) {
    return TrapFile{.top = fmt::format("lifecycle: {{bring_up: [q, r]{}}}\n", lifecycle),
                    .receiver =
                        "takt::test::TrapManaged\n      name: q\n      callbacks: {t: "
                        "{execution: 1ms}}\n    - component: takt::test::TrapManaged"}
        .analyzed()
        .text_of("nothing_is_changed");
  };
  const auto heartbeat = HasSubstr("'/r/t' stays active: no node that `lifecycle` manages misses");
  EXPECT_THAT(closed(", depends_on: {r: [q]}"), heartbeat);
  EXPECT_THAT(closed(", on_loss: shutdown"), heartbeat);
  EXPECT_THAT(closed(""), Not(heartbeat));
  EXPECT_THAT(closed(", depends_on: {r: [q]}, on_loss: report"), Not(heartbeat));
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::TrapTriggered, "is triggered")
TAKT_REGISTER_COMPONENT(takt::test::TrapJoiner, "joins two topics")
TAKT_REGISTER_COMPONENT(takt::test::TrapEmpty, "has no callbacks")
TAKT_REGISTER_COMPONENT(takt::test::TrapSender, "sends")
TAKT_REGISTER_COMPONENT(takt::test::TrapReceiver, "receives")
TAKT_REGISTER_COMPONENT(takt::test::TrapManaged, "receives when it is active")
TAKT_REGISTER_SCHEDULER("trap_claims", "for tests", takt::test::TrapClaims,
                        .order = takt::analysis::Order::by_urgency)
