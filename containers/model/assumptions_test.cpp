// What nobody checks, what is refuted, and what no number tells: none of it is guaranteed.
// SPDX-License-Identifier: Apache-2.0
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// All that a file can say so that nothing is left to assume: one timer of 1 ms in each 10 ms.
constexpr const char* kComplete = R"(
realtime: require
memory: {lock: true}
machine: {overheads: {dispatch: 5us, wake: 50us, switch: 5us, publish: {message: 5us, receiver: 5us}}, rt_runtime: 950ms}
accept: {as_declared: 'of the data sheet', nothing_else_runs: 'nobody logs in'}
)";

struct File {
  std::string top = kComplete, threads, dds, component = "takt::Workload", callbacks, parameters,
              more, chain;

  std::string text() const {
    return top + dds + R"(
threads:
  main_cpu: {policy: SCHED_FIFO, priority: 50, affinity: [0]}
)" + threads +
           R"(
executors: {default: {type: events, threads: [main_cpu]}}
chains: [{name: c, deadline: 5ms, path: [y/y_timer])" +
           chain + R"(}]
container:
  name: assumed
  components:
    - component: takt::Workload
      name: y
      executor: default
      parameters: {publishers: {topic: ["y"], period_us: [10000], work_us: [1000]}}
)" + more;
  }
  /// With a component beside the timer, on its executor.
  File with(const std::string& type, const std::string& keys = "") const {
    File result = *this;
    result.more += "    - {component: '" + type + "', name: x, executor: default" + keys + "}\n";
    return result;
  }
  File with_dds(const std::string& keys) const {
    File result = *this;
    result.dds = "dds: {" + keys + "}\n";
    return result;
  }
  File with_thread(const std::string& entry) const {
    File result = *this;
    result.threads += "  " + entry + "\n";
    return result;
  }
};

/// Of a run in which it did what the file says.
MeasuredModel run_of_the_timer() {
  MeasuredModel measured{
      .duration = 10s, .dispatch_overhead = {.longest = 1us}, .wake_overhead = {.longest = 1us}};
  measured.callbacks.push_back({.name = "/y/y_timer",
                                .executions = 100,
                                .longest_execution = 1ms,
                                .least_distances = {10ms}});
  return measured;
}

TEST(Assumptions, AFileThatSaysAllIsGuaranteed) {
  const Analyzed found = analyzed(File().text());
  EXPECT_THAT(found.missing(), IsEmpty());
  EXPECT_EQ(found.verdict(), Verdict::guaranteed);
  EXPECT_EQ(describe(found.chain(), found.bound()), "guaranteed (2 accepted)");
}

// They counted as nothing, and 0.1 ms were guaranteed for sending 8 MB.
TEST(Assumptions, OverheadsAreNeverZeroInSilence) {
  File file;
  file.top = "realtime: require\nmemory: {lock: true}\n";
  const Analyzed found = analyzed(file.text());
  EXPECT_EQ(found.verdict(), Verdict::bounded_if);
  EXPECT_THAT(found.missing(), ElementsAre("nothing_else_runs", "overheads_are_zero"));
  EXPECT_THAT(found.text_of("overheads_are_zero"), HasSubstr("sending a message"));
  file.top += "accept: {overheads_are_zero: 'of a textbook', nothing_else_runs: 'of it, too'}\n";
  EXPECT_EQ(analyzed(file.text()).verdict(), Verdict::guaranteed);
}

// A callback beside the chain ended its instances, and each was guaranteed.
TEST(Assumptions, AnInstanceMayBeEndedBesideItsChain) {
  const auto verdict = [](const char* deadline, const char* path) {
    File file;
    file.more =
        "    - {component: 'takt::Workload', name: z, executor: default, parameters: "
        "{subscriptions: {topic: ['y'], work_us: [100]}}}\n";
    std::string text =
        file.with("takt::Workload",
                  fmt::format(", parameters: {{subscriptions: {{topic: ['y'], work_us: [1500]}}}}, "
                              "callbacks: {{'y': {{deadline: {}, overrun: abort}}}}",
                              deadline))
            .text();
    const std::string_view given = "y/y_timer";
    text.replace(text.find(given), given.size(), path);
    return analyzed(text).verdict();
  };
  EXPECT_EQ(verdict("9ms", "y/y_timer, z/y"), Verdict::guaranteed);
  EXPECT_EQ(verdict("1ms", "y/y_timer, z/y"), Verdict::may_lose);
  EXPECT_EQ(verdict("1ms", "y/y_timer"), Verdict::guaranteed);  // it has come to its end before
}

// A name was taken for a format.
TEST(Assumptions, NamesMayHaveBraces) {
  const Analyzed found = analyzed(File()
                                      .with_thread("'a{b}': {policy: SCHED_FIFO, priority: 90}")
                                      .with_dds("threads: 'a{b}'")
                                      .text());
  EXPECT_NE(found.verdict(), Verdict::guaranteed);
}

TEST(Assumptions, SendingCountsByItsSize) {
  const auto bound = [](const char* publish) {
    File file;
    file.top = fmt::format("machine: {{overheads: {{publish: {}}}}}", publish);
    return *analyzed(file.with("takt::Workload",
                               ", parameters: {publishers: {topic: [x], "
                               "period_us: [10000], size_bytes: [2000000]}}")
                         .text())
                .bound()
                .bound;
  };
  EXPECT_EQ(bound("10us"), 1000us + 2 * 10us);
  EXPECT_EQ(bound("{message: 10us, megabyte: 500us}"), 1000us + 2 * 10us + 1000us);
}

TEST(Assumptions, WhoWakesSwitchesToItsThread) {
  const auto bound = [](const char* overheads) {
    File file;
    file.top = fmt::format("machine: {{overheads: {{{}}}}}", overheads);
    return *analyzed(file.text()).bound().bound;
  };
  EXPECT_EQ(bound("wake: 50us, switch: 5us"), bound("wake: 55us"));
}

TEST(Assumptions, TheHostOfAVirtualMachineIsOne) {
  const MachineFacts shared = quiet(/*is_virtual=*/true);
  const Analyzed found = analyzed(File().text(), nullptr, false, shared);
  EXPECT_THAT(found.missing(), ElementsAre("host_not_shared"));
  const Analyzed unknown = analyzed(File().text(), nullptr, false, {});
  EXPECT_THAT(unknown.missing(), Contains("rt_runtime_as_here"));
  // What the file states was assumed in silence.
  File stated;
  stated.top = "machine: {rt_runtime: unlimited}";
  EXPECT_THAT(analyzed(stated.text(), nullptr, false, {}).text_of("rt_runtime_as_here"),
              HasSubstr("as much to real-time threads as `rt_runtime` says"));
}

// Those that there were when the file was analysed counted as all that there would ever be.
TEST(Assumptions, OtherThreadsMayComeAndThoseThatAreThereAreNamed) {
  File file;
  file.top.replace(file.top.find(", nothing_else_runs: 'nobody logs in'"), 37, "");
  MachineFacts busy = kQuiet;
  const auto found = [&] { return analyzed(file.text(), nullptr, false, busy); };
  EXPECT_THAT(found().missing(), ElementsAre("nothing_else_runs"));
  busy.others.push_back({.name = "audio", .process = 12, .priority = 50, .cpus = {0, 1}});
  EXPECT_THAT(found().text_of("nothing_else_runs"), HasSubstr("'audio' of process 12"));
  busy.others[0].process = 0;
  EXPECT_THAT(found().text_of("nothing_else_runs"), HasSubstr("'audio' of a component"));
  busy.others[0].priority = 49;  // it takes of what Linux grants to both
  EXPECT_THAT(found().text_of("nothing_else_runs"), HasSubstr("'audio'"));
  busy.others[0] = {.name = "audio", .priority = 90, .cpus = {1}};
  EXPECT_THAT(found().text_of("nothing_else_runs"), Not(HasSubstr("'audio'")));
  file.top += "analysis: {watch: true}\n";
  EXPECT_THAT(found().missing(), IsEmpty());
}

// A node made a timer of 6 ms when it was configured.
/// A watchdog: made cancelled, and restarted by code.
class AssumedMotor : public Node {
 public:
  explicit AssumedMotor(const NodeOptions& options) : Node("motor", options) {
    timer_ = create_timer("command_timeout", 20ms, [] {});
    timer_->cancel();
  }

 private:
  Timer::SharedPtr timer_;
};

TEST(Assumptions, ATimersNameSaysNothing) {
  const std::string text =
      File()
          .with("takt::test::AssumedMotor", ", callbacks: {command_timeout: {execution: 4ms}}")
          .text();
  EXPECT_EQ(analyzed(text).bound().bound.value_or(0ns) / 1ms, 5);
  EXPECT_EQ(verdict_of(text), Verdict::not_shown);
  // Its code may make others, or release this one earlier.
  EXPECT_THAT(analyzed(text).text_of("as_declared"),
              HasSubstr("'/x/command_timeout' keeps its period"));
  EXPECT_THAT(analyzed(text).text_of("as_declared"),
              HasSubstr("'/x' makes no other callbacks later"));
}

TEST(Assumptions, ARunMayRefuteThePeriodOfATimer) {
  MeasuredModel measured = run_of_the_timer();
  EXPECT_EQ(verdict_of(File().text(), &measured), Verdict::guaranteed);
  measured.callbacks[0].least_distances = {9ms};
  EXPECT_EQ(verdict_of(File().text(), &measured), Verdict::refuted);
}

// It said nothing, and 0.1 ms were guaranteed for a callback of 5 ms.
TEST(Assumptions, ABudgetThatNoRunHasShownIsAPromise) {
  File file;
  file.top.replace(file.top.find("accept: "), std::string::npos, "");
  const std::string text =
      file.with("takt::test::AssumedMotor", ", callbacks: {command_timeout: {budget: 1ms}}").text();
  EXPECT_THAT(analyzed(text).missing(), Contains("as_declared"));
  EXPECT_THAT(analyzed(text).text_of("as_declared"),
              HasSubstr("'/x/command_timeout' is longer than its budget"));
}

const char* const kBesideAReservation = R"(
realtime: require
threads:
  a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}
  b: {policy: SCHED_DEADLINE, runtime: 1ms, period: 10ms}
executors: {a: {type: events, threads: [a]}, b: {type: events, threads: [b]}}
container:
  components:
    - {component: takt::Workload, name: x, executor: a,
       parameters: {publishers: {topic: [x], period_us: [20000], work_us: [1000]}}}
    - {component: takt::Workload, name: z, executor: b,
       parameters: {publishers: {topic: [z], period_us: [20000], work_us: [100]}}}
chains: [{name: x, deadline: 10ms, path: [x/x_timer]}]
)";

// Without HRTICK_DL a reservation runs until the next tick, before what is beside it.
TEST(Assumptions, TheKernelEndsAReservationInTime) {
  EXPECT_THAT(analyzed(kBesideAReservation).text_of("reservations_end"),
              HasSubstr("each budget of 'b'"));
  std::string of_itself = kBesideAReservation;
  of_itself.replace(of_itself.find("[x/x_timer]"), 11, "[z/z_timer]");
  EXPECT_THAT(analyzed(of_itself).text_of("reservations_end"), HasSubstr("each budget of 'b'"));
  EXPECT_EQ(analyzed(kBesideAReservation).bound().bound, 3'333'333ns);
}

// It runs threads without a real-time policy before those that have one, also reserved ones.
TEST(Assumptions, TheFairServerIsOne) {
  MachineFacts newer = kQuiet;
  newer.fair_server = 50ms;
  const auto found = [&](const std::string& text) {
    return analyzed(text, nullptr, false, newer).text_of("rt_runtime_as_here");
  };
  EXPECT_THAT(found(File().text()), HasSubstr("only when these have used"));
  EXPECT_THAT(found(kBesideAReservation), HasSubstr("no other threads before those of 'b'"));
  const std::string watched = std::string("analysis: {watch: true}\n") + kBesideAReservation;
  EXPECT_THAT(analyzed(watched, nullptr, false, newer).missing(), Contains("rt_runtime_as_here"));
  EXPECT_THAT(
      analyzed("analysis: {watch: true}\n" + File().text(), nullptr, false, newer).missing(),
      IsEmpty());
  newer.fair_server = 0ms;
  EXPECT_THAT(found(File().text()), Not(HasSubstr("fair server")));
}

TEST(Assumptions, WhatTheFileSaysOfThisMachineIsCompared) {
  File file;
  file.top.replace(file.top.find("rt_runtime: 950ms"), 17, "rt_runtime: unlimited");
  const bool is_throttled = realtime_grant().is_limited();
  EXPECT_EQ(analyzed(file.text()).assumption("rt_runtime_as_here") != nullptr, is_throttled);
}

// The file said that one comes in a second, and a thread of the sender's component sent every 3 ms.
TEST(Assumptions, ARunMayRefuteAnArrivalBesideSendersOfTheFile) {
  const std::string text =
      File()
          .with("takt::Workload",
                ", parameters: {subscriptions: {topic: ['y'], work_us: [100]}}, callbacks: {y: "
                "{arrival: {period: 1s}}}")
          .text();
  MeasuredModel measured{.duration = 10s};
  measured.callbacks.push_back({.name = "/x/y",
                                .executions = 200,
                                .longest_execution = 100us,
                                .uncaused = 100,
                                .uncaused_distances = {3ms}});
  const Analyzed found = analyzed(text, &measured, /*accepts_all=*/true);
  EXPECT_EQ(found.verdict(), Verdict::refuted);
  EXPECT_THAT(found.text_of("as_declared"), HasSubstr("2 arrivals of '/x/y' came within"));
  measured.callbacks[0].uncaused_distances = {1s};
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
}

// The file itself put threads of DDS, and those that run code on request, before an executor.
TEST(Assumptions, ThreadsBeforeThoseOfCallbacksAreNotCovered) {
  const auto found = [](const std::string& thread, const std::string& dds = "discovery: 'off'") {
    return analyzed(File().with_thread(thread).with_dds(dds).text(), nullptr, true);
  };
  const char* const kAbove = "{policy: SCHED_FIFO, priority: 95, affinity: [0]}";
  EXPECT_EQ(found(fmt::format("requests: {}", kAbove)).verdict(), Verdict::not_covered);
  EXPECT_THAT(found(fmt::format("requests: {}", kAbove)).missing(),
              ElementsAre("threads.requests"));
  EXPECT_EQ(found(fmt::format("d: {}", kAbove), "threads: d").verdict(), Verdict::not_covered);
  EXPECT_EQ(found("log: {policy: SCHED_FIFO, priority: 49, affinity: [0]}").verdict(),
            Verdict::guaranteed);
  EXPECT_EQ(found("log: {policy: SCHED_FIFO, priority: 95, affinity: [1]}").verdict(),
            Verdict::guaranteed);
  const Analyzed elsewhere =
      analyzed(File().with_thread("log: {policy: SCHED_FIFO, priority: 95}").text());
  EXPECT_THAT(elsewhere.missing(), ElementsAre("threads.log"));  // it may run there
}

TEST(Assumptions, OthersMaySendIfTheyFindTheTopic) {
  const File file = File().with("takt::Workload",
                                ", parameters: {subscriptions: {topic: [z]}}, "
                                "callbacks: {z: {arrival: {period: 1s}}}");
  EXPECT_THAT(analyzed(file.text()).missing(), IsEmpty());
  EXPECT_THAT(analyzed(file.with_dds("discovery: 'off'").text()).missing(), IsEmpty());
  EXPECT_THAT(analyzed(file.with_dds("discovery: localhost").text()).missing(),  // and it is taken
              ElementsAre("overheads_are_zero", "no_other_publishers", "nothing_is_changed"));
  EXPECT_THAT(analyzed(File().with_dds("discovery: localhost").text()).missing(),
              Contains("no_other_publishers"));  // who receives makes sending longer
}

TEST(Assumptions, TheStartCountsUnlessTheChainSaysOtherwise) {
  File file = File().with("takt::Workload",
                          ", parameters: {subscriptions: {topic: ['y'], durability: "
                          "[transient_local]}}");
  file.more.replace(file.more.find("takt::Workload"), 0, "");
  EXPECT_THAT(analyzed(file.text()).missing(), ElementsAre("start_is_over"));
  file.chain = ", from: activation";
  EXPECT_THAT(analyzed(file.text()).missing(), IsEmpty());
}

TEST(Assumptions, AModelFromElsewhereIsOne) {
  MeasuredModel measured = run_of_the_timer();
  EXPECT_THAT(analyzed(File().text(), &measured).missing(), ElementsAre("as_measured"));
  measured.differs = "it is of 'another one'";
  EXPECT_THAT(analyzed(File().text(), &measured).missing(), Contains("model_from_elsewhere"));
}

TEST(Assumptions, TimesOfOneSpeedAreNotThoseOfAnother) {
  File file;
  file.top += "";
  file.top.replace(file.top.find("machine: {"), 10, "machine: {speed: {0: 0.5}, ");
  EXPECT_THAT(analyzed(file.text()).missing(), ElementsAre("times_scale_with_speed"));
}

TEST(Assumptions, ARunAboveABoundWithoutOverheadsRefutesThese) {
  File file;
  file.top = "realtime: require\nmemory: {lock: true}\naccept: {overheads_are_zero: 'so I say'}\n";
  const MeasuredModel measured{.duration = 10s, .chains = {{.name = "c", .longest = 2ms}}};
  const Analyzed found = analyzed(file.text(), &measured);
  EXPECT_EQ(found.verdict(), Verdict::bounded_if);
  EXPECT_THAT(found.missing(), Contains("overheads_are_zero"));
}

TEST(Assumptions, OnlyThoseOfTheExecutorsOfAChainAreItsOwn) {
  File file = File().with_thread("other: {policy: SCHED_FIFO, priority: 50, affinity: [1]}");
  file.top.replace(file.top.find("machine: {"), 10, "machine: {cpus: [0, 1], ");
  file.more = "    - {component: 'takt::test::AssumedMotor', name: x, executor: apart}\n";
  std::string text = file.text();
  text.replace(text.find("executors: {"), 12,
               "executors: {apart: {type: events, threads: [other]}, ");
  EXPECT_THAT(analyzed(text).text_of("as_declared"), Not(HasSubstr("/x/")));
}

// A key that a library brings, or that somebody has forgotten.
TEST(Assumptions, AKeyWithoutAnEntryIsNotCovered) {
  const auto verdict_with = [](const char* map, const char* entry, const char* key) {
    const ConfigurationFile file("system.yaml", File().text());
    SystemDescription description = file.read();
    description.keys.push_back({map, entry, key, "system.yaml:7"});
    const Container container(description);
    const ModelledProcess process = container.modelled();
    const SystemModel model =
        make_system_model(description, container.plan().chains, {&process, 1}, nullptr, kQuiet);
    return verdict(model.chains.at(0), analyze(model).chains.at(0));
  };
  EXPECT_EQ(verdict_with("a thread", "main_cpu", "priority"), Verdict::guaranteed);
  EXPECT_EQ(verdict_with("a thread", "main_cpu", "new_key"), Verdict::not_covered);
  EXPECT_EQ(verdict_with("dds", "dds", "security"), Verdict::not_covered);
  EXPECT_EQ(verdict_with("an executor", "default", "table"), Verdict::not_covered);
  EXPECT_EQ(verdict_with("an executor", "other", "table"), Verdict::guaranteed);
}

// An id that nothing produces would be one that somebody believes to be looked at.
TEST(Assumptions, EachIdIsProduced) {
  std::set<std::string> found;
  const auto add = [&](const std::string& text, const MeasuredModel* measured = nullptr) {
    for (const MachineFacts& machine : {kQuiet, MachineFacts{}}) {
      const Analyzed result = analyzed(text, measured, false, machine);
      for (const Assumption& each : result.chain().assumptions) found.insert(each.id);
    }
  };
  File open;
  open.top = "machine: {speed: {0: 0.5}}\n";
  add(open.with_thread("log: {policy: SCHED_FIFO, priority: 95}")
          .with("takt::Workload",
                ", parameters: {clients: {service: [s], period_us: [10000]}, "
                "subscriptions: {topic: ['y'], durability: [transient_local]}}, "
                "callbacks: {s_timer: {budget: 1ms}}")
          .with_dds("discovery: localhost")
          .text());
  MeasuredModel measured{.path = "m.yaml", .duration = 10s, .differs = "it is another one"};
  measured.callbacks.push_back(
      {.name = "/x/s_timer", .executions = 9, .longest_execution = 1ms, .least_distances = {10ms}});
  measured.callbacks.push_back({.name = "/z/s", .executions = 0});
  open.more +=
      "    - {component: takt::Workload, name: z, executor: default, parameters: {servers: "
      "{service: [s]}}}\n";
  add(open.with("takt::Workload", ", parameters: {clients: {service: [s], period_us: [10000]}}")
          .with_dds("discovery: localhost")
          .text(),
      &measured);
  measured.callbacks = {{.name = "/l/t", .executions = 9, .longest_execution = 1ms}};
  add("chains: [{name: c, path: [a/t_timer, l/t]}]\ncontainer:\n  components:\n    - {component: "
      "takt::Workload, name: a, parameters: {publishers: {topic: [t], period_us: [10000]}}}\n    - "
      "{component: takt::LifecycleWorkload, name: l, parameters: {subscriptions: {topic: [t]}}}\n",
      &measured);
  add(kBesideAReservation);
  add(two_processes("realtime: require\ntopics: {/x: {delay: {max: 1ms}}}\n"));
  for (const AssumptionKind& kind : assumption_kinds()) {
    EXPECT_TRUE(found.contains(std::string(kind.id))) << kind.id;
  }
}

TEST(Assumptions, UnknownIdsAreRefusedWithTheList) {
  const auto error_of = [](const std::string& text) {
    try {
      analyzed(text);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  File file;
  file.chain = ", accept: {host_not_shard: 'mine'}";
  EXPECT_THAT(error_of(file.text()), HasSubstr("did you mean 'host_not_shared'"));
  file.chain = ", accept: {host_not_shared: ''}";
  EXPECT_THAT(error_of(file.text()), HasSubstr("a text that is not empty"));
  file.chain = ", accept: {host_not_shared: \"mine\\nguaranteed\"}";
  EXPECT_THAT(error_of(file.text()), HasSubstr("the reason is no line of text"));
}

// Best effort between processes loses: the chain was guaranteed.
TEST(Assumptions, BestEffortBetweenProcessesLoses) {
  const auto text = [](const char* reliability) {
    return two_processes(
        fmt::format("topics: {{/x: {{reliability: {}, delay: {{max: 1ms}}}}}}\n", reliability));
  };
  EXPECT_EQ(verdict_of(text("best_effort")), Verdict::may_lose);
  EXPECT_EQ(verdict_of(text("reliable")), Verdict::guaranteed);
  const std::vector<std::string> missing = analyzed(text("reliable")).missing();
  EXPECT_THAT(missing, Contains("nothing_is_changed"));
  EXPECT_THAT(missing, Contains("dds_threads_elsewhere"));
}

TEST(Assumptions, MessagesThatWaitBeyondTheirLifespanAreLost) {
  const auto verdict = [](const char* lifespan) {
    File file = File().with("takt::Workload",
                            ", parameters: {subscriptions: {topic: ['y'], work_us: [100]}}");
    file.top += fmt::format("topics: {{/y: {{lifespan: {}}}}}\n", lifespan);
    std::string text = file.text();
    text.replace(text.find("[y/y_timer]"), 11, "[y/y_timer, x/y]");
    return verdict_of(text);
  };
  EXPECT_EQ(verdict("1s"), Verdict::guaranteed);
  EXPECT_EQ(verdict("1us"), Verdict::may_lose);
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::AssumedMotor, "a timer that code restarts")
