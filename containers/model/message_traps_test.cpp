// What messages cost beside callbacks, and in which runs that was measured.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <initializer_list>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

/// Of 10 s, in which each of these took 1 ms, and was called every 10 ms.
MeasuredModel measured_run(std::initializer_list<const char*> callbacks) {
  MeasuredModel result{.path = "m.yaml", .duration = 10s};
  for (const char* name : callbacks) {
    result.callbacks.push_back(
        {.name = name, .executions = 9, .longest_execution = 1ms, .least_distances = {10ms}});
    if (result.callbacks.size() > 1) result.callbacks[0].causes[name] = 1;
  }
  return result;
}

// What is sent at the end of a period leaves one after the other, and the last message is late.
TEST(MessageTraps, SendingAtTheEndOfAPeriodTakesTime) {
  const auto found = [](const std::string& publish, const std::string& more = {}) {
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, affinity: [1]}}
machine: {cpus: [0, 1], overheads: {publish: )" +
                    publish + R"(}}
executors: {a: {type: triggered, let: 50ms, threads: [a]}, b: {type: events, threads: [b]}}
container:
  components:
    - {component: takt::Workload, name: x, executor: a, parameters: {publishers: {topic: [x], period_us: [50000], work_us: [100], size_bytes: [8000000]}}}
    - {component: takt::Workload, name: s, executor: a, parameters: {publishers: {topic: [s], period_us: [50000], work_us: [100]}})" +
                    more + R"(}
    - {component: takt::Workload, name: r, executor: b, parameters: {subscriptions: {topic: [x, s], work_us: [100, 100]}}}
chains: [{name: c, path: [s/s_timer, r/s]}]
)");
  };
  const Nanoseconds without = found("{message: 0us, megabyte: 0us}").bound().bound.value();
  const Nanoseconds with = found("{message: 1us, megabyte: 1ms}").bound().bound.value();
  EXPECT_GE(with, without + 8ms);
  EXPECT_LE(with, without + 9ms);
  EXPECT_THAT(
      found("1us", ", callbacks: {s_timer: {execution: 1ms}}").text_of("overheads_are_zero"),
      HasSubstr("sending at the end of a period"));
}

// In one process a message of 4 MB is a pointer: what was measured so was used for two.
TEST(MessageTraps, AModelOfOneProcessIsNotOneOfTwo) {
  const auto text = [](const std::string& of_sender, const std::string& of_receiver) {
    MeasuredModel measured = measured_run({"/x/x_timer", "/y/x"});
    measured.executors = {{of_sender + "a", "events", "fifo", {"/x/x_timer"}},
                          {of_receiver + "b", "events", "fifo", {"/y/x"}}};
    return analyzed(two_processes("topics: {/x: {delay: {max: 1ms}}}\n"), &measured)
        .text_of("model_from_elsewhere");
  };
  EXPECT_THAT(text("", ""), HasSubstr("'/x/x_timer', '/y/x' takes as long to send to other"));
  EXPECT_THAT(text("p/", "p/"), HasSubstr("'/x/x_timer', '/y/x' takes"));
  EXPECT_EQ(text("p1/", "p2/"), "");
}

// The last receiver of a message destroys it; on other threads that is another one.
TEST(MessageTraps, TheLastReceiverOfAMessageDestroysIt) {
  const auto found = [](const std::string& first, const std::string& second) {
    MeasuredModel measured = measured_run({"/x/tick", "/y/t", "/z/t"});
    measured.executors = {{first, "events", "fifo", {"/x/tick", "/y/t"}},
                          {second, "events", "fifo", {"/z/t"}}};
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, affinity: [1]}}
machine: {cpus: [0, 1]}
executors: {a: {type: events, threads: [a]}, b: {type: events, threads: [b]}}
container:
  components:
    - {component: tricky::CodeSender, name: x, executor: a}
    - {component: tricky::CodeReceiver, name: y, executor: a}
    - {component: tricky::CodeReceiver, name: z, executor: b}
chains: [{name: c, path: [x/tick, y/t]}]
)",
                    &measured);
  };
  const auto text = HasSubstr("'/y/t' destroys or copies no more");
  EXPECT_THAT(found("a", "b").text_of("as_measured"), text);
  EXPECT_EQ(found("a", "b").text_of("model_from_elsewhere"), "");
  EXPECT_THAT(found("b", "a").text_of("model_from_elsewhere"), text);
}

// A receiver that is not there any more, or gets something else, may have destroyed it.
TEST(MessageTraps, AReceiverThatIsGoneDestroysNothing) {
  MeasuredModel measured = measured_run({"/x/tick", "/y/t"});
  measured.executors = {{"a", "events", "fifo", {"/x/tick", "/y/t"}}};
  const auto text = [&] {
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
machine: {cpus: [0]}
executors: {a: {type: events, threads: [a]}}
container:
  components:
    - {component: tricky::CodeSender, name: x, executor: a}
    - {component: tricky::CodeReceiver, name: y, executor: a}
chains: [{name: c, path: [x/tick, y/t]}]
)",
                    &measured)
        .text_of("model_from_elsewhere");
  };
  measured.callbacks[0].causes = {{"/y/t", 9}};
  EXPECT_EQ(text(), "");
  measured.callbacks[0].causes = {{"/y/t", 9}, {"/z/t", 9}};
  EXPECT_THAT(text(), HasSubstr("'/y/t' destroys or copies no more"));
}

// A subscription that the run did not have gets as many messages as the others of its topic got;
// and if there was none, nobody knows how many are sent.
TEST(MessageTraps, ANewSubscriptionGetsAllThatIsSent) {
  MeasuredModel measured = measured_run({"/x/tick", "/y/t"});
  const auto found = [&] {
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
machine: {cpus: [0]}
executors: {a: {type: events, threads: [a]}}
container:
  components:
    - {component: tricky::CodeSender, name: x, executor: a}
    - {component: tricky::CodeReceiver, name: y, executor: a}
    - {component: tricky::CodeReceiver, name: z, executor: a, callbacks: {t: {execution: 1ms}}}
chains: [{name: c, path: [x/tick, z/t]}]
)",
                    &measured);
  };
  const auto one = HasSubstr("each execution of '/x/tick' sends one message");
  measured.callbacks[0].causes = {{"/y/t", 1}};
  const auto bound = found().bound().bound;
  EXPECT_THAT(found().text_of("as_declared"), Not(one));
  measured.callbacks[0].causes = {{"/y/t", 3}};
  EXPECT_GE(found().bound().bound.value(), bound.value() + 4ms);
  measured.callbacks.pop_back();
  measured.callbacks[0].causes.clear();
  EXPECT_THAT(found().text_of("as_declared"), one);
}

// A message of another program is decoded before its callback, which no component says.
TEST(MessageTraps, AMessageFromOutsideIsTaken) {
  const auto found = [](const char* publish, const char* dds = "{}") {
    return analyzed(fmt::format(R"(
dds: {}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}}}
machine: {{cpus: [0], overheads: {{publish: {{message: {}, megabyte: 300us}}}}}}
executors: {{a: {{type: events, threads: [a]}}}}
container:
  components:
    - {{component: takt::Workload, name: k, executor: a, parameters: {{subscriptions: {{topic: [x], work_us: [10]}}}}, callbacks: {{x: {{arrival: {{period: 20ms}}}}}}}}
chains: [{{name: c, path: [k/x]}}]
)",
                                dds, publish));
  };
  EXPECT_THAT(found("60us").text_of("overheads_are_zero"), HasSubstr("more than a small message"));
  EXPECT_EQ(found("60us").bound().bound.value() - found("10us").bound().bound.value(), 50us);
  EXPECT_THAT(found("60us").text_of("no_other_publishers"),
              HasSubstr("nothing comes to '/k/x' from outside of the file but what its `arrival`"));
  EXPECT_EQ(found("60us", "{discovery: 'off'}").text_of("no_other_publishers"), "");
}

// A delay that was promised to be no shorter was not among what is promised.
TEST(MessageTraps, TheLeastDelayIsAPromise) {
  const auto text = [](const char* delay) {
    return analyzed(two_processes(fmt::format("topics: {{/x: {{delay: {{{}}}}}}}\n", delay)))
        .text_of("as_declared");
  };
  EXPECT_THAT(text("min: 1ms, max: 2ms"), HasSubstr("than its `delay` says, or less"));
}

// Whatever sends to a topic from outside reaches all of its subscriptions, also the one that states
// nothing.
TEST(MessageTraps, AllSubscriptionsOfATopicGetWhatComesFromOutside) {
  const char* const kArrival = "callbacks: {x: {arrival: {period: 10ms}}}";
  const auto found = [](const std::string& first, const std::string& other = {},
                        const char* lifespan = "", const MeasuredModel* measured = nullptr) {
    return analyzed(fmt::format(R"(
topics: {{/x: {{depth: 10{}}}}}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}}}
machine: {{cpus: [0]}}
executors: {{a: {{type: events, threads: [a]}}, b: {{type: events, threads: [b]}}}}
container:
  components:
    - {{component: takt::Workload, name: k, executor: a, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}, {}}}
    - {{component: takt::Workload, name: l, executor: a, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}, {}}}
    - {{component: takt::Workload, name: d, executor: b, parameters: {{publishers: {{topic: [d], period_us: [20000], work_us: [3000]}}}}}}
chains: [{{name: c, path: [d/d_timer]}}, {{name: k, path: [k/x]}}]
)",
                                lifespan, first, other),
                    measured);
  };
  const auto bound = found(kArrival).bound().bound;
  EXPECT_GE(bound.value(), 5ms);
  EXPECT_EQ(found(kArrival, kArrival).bound().bound, bound);
  // Whichever way it is known.
  EXPECT_EQ(found("callback_groups: {default: {period: 10ms}}").bound().bound, bound);
  const MeasuredModel measured{.path = "m.yaml",
                               .duration = 10s,
                               .callbacks = {{.name = "/k/x",
                                              .executions = 9,
                                              .longest_execution = 100us,
                                              .least_distances = {10ms},
                                              .uncaused = 9,
                                              .uncaused_distances = {10ms}}}};
  EXPECT_EQ(found("", "", "", &measured).bound().bound, bound);
  EXPECT_THAT([&] { found(kArrival, "callbacks: {x: {arrival: {period: 20ms}}}"); },
              ThrowsMessage<Error>(HasSubstr("'/l/x' get the same, and have another 'arrival'")));
  EXPECT_EQ(found(kArrival).bounds.chains.at(1).why_lossy, "");
  EXPECT_THAT(found(kArrival, "", ", lifespan: 500us").bounds.chains.at(1).why_lossy,
              HasSubstr("may take and wait longer than their lifespan"));
}

TEST(MessageTraps, AMessageMayExpireOnItsWay) {
  const auto why = [](const char* lifespan) {
    return analyzed(two_processes(fmt::format(
                        "topics: {{/x: {{delay: {{max: 6ms}}, lifespan: {}}}}}\n", lifespan)))
        .bound()
        .why_lossy;
  };
  EXPECT_THAT(why("5ms"), HasSubstr("may take and wait longer than their lifespan"));
  EXPECT_EQ(why("1s"), "");
}

// A deadline counts from when a message was sent; a bound, from when it has come.
TEST(MessageTraps, WhatCountsFromWhenAMessageWasSentHasLessLeft) {
  const auto found = [](const char* delay, const char* scheduler, const char* type = "events") {
    return analyzed(fmt::format(R"(
topics: {{/x: {{delay: {{max: {}}}}}}}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: {}, affinity: [1]}}}}
machine: {{cpus: [0, 1]}}
executors: {{a: {{type: events, threads: [a]}}, b: {{type: {}, scheduler: {}, threads: [b]}}}}
containers:
  - name: p
    components:
      - {{component: takt::Workload, name: s, executor: a, parameters: {{publishers: {{topic: [x], period_us: [50000], work_us: [100]}}}}}}
  - name: q
    components:
      - {{component: takt::Workload, name: l, executor: b, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}, callbacks: {{x: {{deadline: 10ms, overrun: abort}}}}}}
      - {{component: takt::Workload, name: m, executor: b, parameters: {{publishers: {{topic: [m], period_us: [20000], work_us: [3000]}}}}, callbacks: {{m_timer: {{deadline: 4ms}}}}}}
      - {{component: takt::Workload, name: v, executor: b, parameters: {{publishers: {{topic: [v], period_us: [50000], work_us: [2000]}}}}, callbacks: {{v_timer: {{deadline: 30ms}}}}}}
chains: [{{name: c, path: [m/m_timer]}}, {{name: x, path: [s/x_timer, l/x]}}]
)",
                                delay, std::string_view(type) == "events" ? "60" : "60..68", type,
                                scheduler));
  };
  EXPECT_EQ(found("1ms", "fifo").bounds.chains.at(1).why_lossy, "");
  EXPECT_THAT(found("9ms", "fifo").bounds.chains.at(1).why_lossy,
              HasSubstr("then ends the instance"));
  // Due at the latest after 10 ms, but it may be late by so much that it is more urgent than `m`.
  EXPECT_LT(found("0us", "edf").bound().bound.value(), 6ms);
  EXPECT_GE(found("9ms", "edf").bound().bound.value(), 6ms);
  EXPECT_TRUE(found("0us", "edf", "preemptive").bound().bound);
  EXPECT_THAT(
      found("9ms", "edf", "preemptive").bound().why_not,
      HasSubstr("'edf' orders by a point in time that counts from when a message was sent"));
}

/// Two subscriptions of a topic that messages from outside come to, on a thread each: what is said
/// of the second one counts for a chain of the first.
Analyzed with_outside(const std::string& keys, const std::string& others,
                      std::initializer_list<MeasuredCallback> seen = {}, const char* topic = "") {
  const MeasuredModel measured{.path = "m.yaml", .duration = 10s, .callbacks = seen};
  return analyzed(fmt::format(R"(
topics: {{/x: {{depth: 100{}}}}}
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}}}
machine: {{cpus: [0, 1]}}
executors: {{a: {{type: events, threads: [a]}}, b: {{type: events, threads: [b]}}}}
container:
  components:
    - {{component: takt::Workload, name: k, executor: a, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}, callbacks: {{x: {{{}}}}}}}
    - {{component: takt::Workload, name: l, executor: b, parameters: {{subscriptions: {{topic: [x], work_us: [1000]}}}}, callbacks: {{x: {{{}}}}}}}
chains: [{{name: k, deadline: 100ms, path: [k/x]}}]
)",
                              topic, keys, others),
                  seen.size() != 0 ? &measured : nullptr, /*accepts_all=*/true);
}

/// What came to a callback from outside: so many, and so close.
MeasuredCallback came(const char* name, std::uint64_t executions, Nanoseconds closest,
                      std::uint64_t dropped = 0) {
  return {.name = name,
          .executions = executions,
          .longest_execution = 100us,
          .least_distances = {closest, closest + 10ms},
          .dropped = dropped,
          .uncaused = executions,
          .uncaused_distances = {closest, closest + 10ms}};
}

// A receiver that lost some, came late or was not there knew less than the others.
TEST(MessageTraps, WhatOneReceiverHasSeenComesToAll) {
  const auto bound = [](std::initializer_list<MeasuredCallback> seen) {
    return with_outside("priority: 1", "priority: 1", seen).bound();
  };
  EXPECT_EQ(bound({came("/k/x", 900, 5ms)}).bound, 1ms);
  EXPECT_EQ(bound({came("/k/x", 900, 5ms), came("/l/x", 1000, 0ms)}).bound, 2ms);
  EXPECT_EQ(bound({came("/k/x", 1000, 0ms), came("/l/x", 900, 5ms)}).bound, 2ms);
  EXPECT_EQ(bound({came("/k/x", 1000, 5ms), came("/l/x", 100, 5ms, 900)}).bound, 1ms);
  EXPECT_THAT(bound({came("/k/x", 100, 5ms), came("/l/x", 100, 5ms, 900)}).why_not,
              HasSubstr("how often '/k/x' runs"));
}

TEST(MessageTraps, ARunThatRefutesAnArrivalRefutesItForAllReceivers) {
  const auto verdict = [](Nanoseconds closest) {
    return with_outside("priority: 1", "arrival: {period: 10ms}", {came("/l/x", 100, closest)})
        .verdict();
  };
  EXPECT_EQ(verdict(10ms), Verdict::guaranteed);
  EXPECT_EQ(verdict(2ms), Verdict::refuted);
}

TEST(MessageTraps, WhatAnotherProcessOfTheFileSendsRefutesNoArrival) {
  std::string text = two_processes("topics: {/x: {delay: 1ms}}\n");
  const std::string subscription = "subscriptions: {topic: [x], work_us: [100]}}";
  text.insert(text.find(subscription) + subscription.size(),
              ", callbacks: {x: {arrival: {period: 1s}}}");
  const MeasuredModel measured{.duration = 10s, .callbacks = {came("/y/x", 500, 20ms)}};
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
}

// It counted where the file states the arrival, and not where a run has shown it.
TEST(MessageTraps, WhatComesFromOutsideAgesAndIsKeptAwayHoweverItIsKnown) {
  const auto why = [](const char* topic, Nanoseconds closest = 5ms) {
    return with_outside("priority: 1", "", {came("/k/x", 100, closest)}, topic).bound().why_lossy;
  };
  EXPECT_EQ(why(""), "");
  EXPECT_THAT(why(", lifespan: 500us"), HasSubstr("longer than their lifespan"));
  EXPECT_THAT(why(", lifespan: 5ms, delay: 6ms"), HasSubstr("longer than their lifespan"));
}

TEST(MessageTraps, PromisesOfOneTopicAgree) {
  const auto bound = [](const char* first, const char* second) {
    return with_outside(first, second).bound().bound;
  };
  EXPECT_EQ(bound("period: 10ms", "period: 10ms"), 1ms);
  EXPECT_THAT([&] { bound("period: 10ms", "period: 40ms"); },
              ThrowsMessage<Error>(HasSubstr("'/l/x' has a 'period' of 40ms, and what it gets")));
  EXPECT_EQ(bound("arrival: {period: 40ms}", "period: 10ms"), 1ms);
  EXPECT_THAT([&] { bound("arrival: {period: 10ms}", "period: 40ms"); },
              ThrowsMessage<Error>(HasSubstr("and what it gets has one of 10ms")));
}

// What is overwritten may have been sent at once.
TEST(MessageTraps, WhereAllReceiversLoseSomeNobodyKnowsHowManyAreSent) {
  MeasuredModel measured = measured_run({"/x/tick", "/y/t", "/z/t"});
  measured.callbacks[0].causes = {{"/y/t", 1}, {"/z/t", 1}};
  const auto text = [&](std::uint64_t first, std::uint64_t second) {
    measured.callbacks[1].dropped = first;
    measured.callbacks[2].dropped = second;
    return analyzed(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
machine: {cpus: [0]}
executors: {a: {type: events, threads: [a]}}
container:
  components:
    - {component: tricky::CodeSender, name: x, executor: a}
    - {component: tricky::CodeReceiver, name: y, executor: a}
    - {component: tricky::CodeReceiver, name: z, executor: a}
chains: [{name: c, path: [x/tick, y/t]}]
)",
                    &measured)
        .text_of("not_seen");
  };
  const auto sends = HasSubstr("'/x/tick' sends more than 1 message at once to '/y/t'");
  EXPECT_THAT(text(0, 0), Not(sends));
  EXPECT_THAT(text(3, 7), sends);
}

// A trace has no causes of other processes, so it does not show who sends, or how many at once.
TEST(MessageTraps, ARunDoesNotShowWhatIsSentToAnotherProcess) {
  MeasuredModel measured = measured_run({"/x/tick", "/y/t"});
  measured.executors = {{"p1/a", "events", "fifo", {"/x/tick"}},
                        {"p2/b", "events", "fifo", {"/y/t"}}};
  const std::string text = analyzed(R"(
topics: {/t: {delay: 1ms}}
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, affinity: [1]}}
machine: {cpus: [0, 1]}
executors: {a: {type: events, threads: [a]}, b: {type: events, threads: [b]}}
containers:
  - {name: p1, components: [{component: tricky::CodeSender, name: x, executor: a}]}
  - {name: p2, components: [{component: tricky::CodeReceiver, name: y, executor: b}]}
chains: [{name: c, path: [x/tick, y/t]}]
)",
                                    &measured)
                               .text_of("as_declared");
  EXPECT_THAT(text, HasSubstr("each execution of '/x/tick' sends one message"));
  EXPECT_THAT(text, HasSubstr("no thread that it has made"));
}

// On one thread nobody has to wait for a lock.
TEST(MessageTraps, CallbacksOfOtherThreadsMayHoldALock) {
  MeasuredModel measured = measured_run({"/x/tick", "/y/t", "/z/t"});
  measured.executors = {{"a", "events", "fifo", {"/x/tick", "/y/t", "/z/t"}}};
  const auto text = [&](const char* other) {
    return analyzed(fmt::format(R"(
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}}}
machine: {{cpus: [0, 1]}}
executors: {{a: {{type: events, threads: [a]}}, b: {{type: events, threads: [b]}}}}
container:
  components:
    - {{component: tricky::CodeSender, name: x, executor: a}}
    - {{component: tricky::CodeReceiver, name: y, executor: a}}
    - {{component: tricky::CodeReceiver, name: z, executor: {}}}
chains: [{{name: c, path: [x/tick, y/t]}}]
)",
                                other),
                    &measured)
        .text_of("as_measured");
  };
  EXPECT_THAT(text("b"), HasSubstr("'/y/t' waits for no lock of callbacks that are on other"));
  EXPECT_THAT(text("a"), Not(HasSubstr("waits for no lock")));
}

// Between two processes of the file it might be lost, and from outside it was guaranteed.
TEST(MessageTraps, BestEffortMayLoseWhatComesFromOutside) {
  const auto why_lossy = [](const char* reliability, const char* dds) {
    return bound_of(fmt::format(R"(
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}}}
executors: {{a: {{type: events, threads: [a]}}}}
topics: {{/x: {{delay: 1ms, reliability: {}}}}}
dds: {{{}}}
container: {{components: [{{component: takt::Workload, name: "y", executor: a, callbacks: {{x: {{arrival: {{period: 10ms}}}}}}, parameters: {{subscriptions: {{topic: [x], work_us: [100]}}}}}}]}}
chains: [{{name: c, deadline: 90ms, path: ["y/x"]}}]
)",
                                reliability, dds))
        .why_lossy;
  };
  EXPECT_EQ(why_lossy("reliable", ""), "");
  EXPECT_THAT(why_lossy("best_effort", ""),
              HasSubstr("messages on '/x' come from outside, and `best_effort`"));
  EXPECT_EQ(why_lossy("best_effort", "discovery: 'off'"), "");
}

// A chain may begin where a message of another process arrives.
TEST(MessageTraps, BestEffortMayLoseTheFirstMessageOfAChain) {
  std::string text = two_processes("topics: {/x: {delay: 1ms, reliability: best_effort}}\n");
  text.replace(text.find("x/x_timer, y/x"), 14, "y/x");
  EXPECT_THAT(bound_of(text).why_lossy, HasSubstr("go to another process"));
}

// Beside senders in other processes, what came from outside is only known by its number.
TEST(MessageTraps, MoreThanAnArrivalAllowsRefutesItBesideOtherSenders) {
  MeasuredModel measured = measured_run({"/x/x_timer", "/y/x"});
  const auto refuted = [&](std::uint64_t received) {
    measured.callbacks[0].executions = 500;
    measured.callbacks[0].least_distances = {20ms};
    measured.callbacks[1].executions = received;
    std::string text = two_processes("topics: {/x: {delay: 1ms}}\n");
    text.insert(text.find("name: y, ") + 9, "callbacks: {x: {arrival: {period: 1s}}}, ");
    const Analyzed found = analyzed(text, &measured);
    for (const Assumption& each : found.chain().assumptions) {
      if (each.state == Assumption::State::refuted) return each.text;
    }
    return std::string();
  };
  EXPECT_EQ(refuted(510), "");
  EXPECT_THAT(refuted(530), HasSubstr("30 messages came to '/y/x' from outside"));
}

}  // namespace
}  // namespace takt::test
