// Traps that a third author found, who knew only the documents: of CPUs, bands and overruns.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A chain of one timer of 10 ms on thread a, and one of 1 ms on thread b.
std::string two_threads(const std::string& machine, const std::string& a, const std::string& b,
                        const std::string& types = "events") {
  return fmt::format(R"(
machine: {{cpus: [0, 1], {}}}
threads:
  a: {{{}}}
  b: {{{}}}
executors:
  e: {{type: {}, threads: [a]}}
  f: {{type: events, threads: [b]}}
chains: [{{name: c, deadline: 90ms, path: [x/x_timer]}}]
container:
  components:
    - {{component: takt::Workload, name: x, executor: e, parameters: {{publishers: {{topic: [x], period_us: [100000], work_us: [10000]}}}}}}
    - {{component: takt::Workload, name: z, executor: f, parameters: {{publishers: {{topic: [z], period_us: [5000], work_us: [1000]}}}}}}
)",
                     machine, a, b, types);
}

// A simulation, which divides a dispatch by the speed, was above the bound.
TEST(CpuTraps, ADispatchTakesLongerOnASlowCpu) {
  const auto bound = [](const char* machine) {
    return bound_of(two_threads(machine, "policy: SCHED_FIFO, priority: 60, affinity: [1]",
                                "policy: SCHED_FIFO, priority: 60, affinity: [0]"))
        .bound.value();
  };
  const Nanoseconds without = bound("speed: {1: 0.5}");
  EXPECT_EQ(bound("speed: {1: 0.5}, overheads: {dispatch: 100us}"), without + 200us);
  EXPECT_EQ(bound("speed: {1: 2}, overheads: {dispatch: 100us}"), bound("speed: {1: 2}") + 100us);
}

// With a CPU for each, a thread that is moved to the other one was said to be there at once.
TEST(CpuTraps, AThreadThatIsMovedPaysForTheSwitches) {
  const auto found = [](const char* overheads, const char* a, const char* b) {
    return bound_of(two_threads(overheads, a, b));
  };
  const char* const urgent = "policy: SCHED_FIFO, priority: 80, affinity: [0]";
  const char* const free = "policy: SCHED_FIFO, priority: 60, affinity: [0, 1]";
  const char* const apart = "policy: SCHED_FIFO, priority: 60, affinity: [1]";
  const char* const costs = "overheads: {switch: 100us, wake: 1us}";
  EXPECT_EQ(found("", free, urgent).bound, found("", apart, urgent).bound);
  // Three or four executions of the other one in the time of one.
  EXPECT_GE(*found(costs, free, urgent).bound, *found(costs, apart, urgent).bound + 600us);
  EXPECT_LE(*found(costs, free, urgent).bound, *found(costs, apart, urgent).bound + 1ms);
  const char* const reserved = "policy: SCHED_DEADLINE, runtime: 2ms, period: 5ms";
  EXPECT_GE(*found(costs, free, reserved).bound, *found(costs, apart, urgent).bound + 600us);
  // So its bound rests on the numbers of the other one, too.
  const auto rests_on = [&](const char* machine) {
    const Analyzed result =
        analyzed(two_threads(fmt::format("rt_runtime: unlimited, {}", machine), free, urgent));
    return result.chain().executors.size();
  };
  EXPECT_EQ(rests_on(costs), 2u);
  EXPECT_EQ(rests_on("overheads: {wake: 1us}"), 1u);
  // Linux does not move a thread of SCHED_OTHER at once.
  EXPECT_EQ(found("exclusive: true", "affinity: [1]", urgent).why_not, "");
  EXPECT_THAT(found("exclusive: true", "affinity: [0, 1]", urgent).why_not,
              HasSubstr("without real-time priorities"));
}

/// With `--executor preemptive`.
ModelledProcess with_bands(const std::string& text) {
  const ConfigurationFile file("system.yaml", text);
  const Container container(file.read(), {.executor = "preemptive"});
  return container.modelled();
}
/// The priorities of an executor's threads on one CPU.
std::vector<int> priorities(const ModelledProcess& process, std::size_t executor, int cpu) {
  std::vector<int> result;
  for (const std::string& name : process.executors.at(executor).threads) {
    const auto thread = std::find_if(process.threads.begin(), process.threads.end(),
                                     [&](const auto& each) { return each.name == name; });
    EXPECT_THAT(thread->affinity, ElementsAre(cpu)) << name;
    result.push_back(thread->priority);
  }
  return result;
}

// The bound was that of the file's thread, and the run had a band, on one of its CPUs.
TEST(CpuTraps, ABandInPlaceOfThreadsIsInTheModel) {
  const ModelledProcess process =
      with_bands(two_threads("", "policy: SCHED_FIFO, priority: 70, affinity: [0, 1]",
                             "policy: SCHED_FIFO, priority: 85, affinity: [0]"));
  EXPECT_THAT(priorities(process, 0, 0), ElementsAre(70, 71, 72, 73, 74, 75, 76, 77));
  EXPECT_THAT(priorities(process, 1, 0), ElementsAre(85, 86, 87, 88, 89, 90, 91, 92));
}

// Two bands overlapped, and the bounds did not know it.
TEST(CpuTraps, ABandInPlaceOfThreadsEndsBelowOtherThreads) {
  const auto bands = [](int a, int b, const char* cpu_of_b) {
    const ModelledProcess process = with_bands(
        two_threads("", fmt::format("policy: SCHED_FIFO, priority: {}, affinity: [0]", a),
                    fmt::format("policy: SCHED_FIFO, priority: {}, affinity: [{}]", b, cpu_of_b)));
    return std::pair(priorities(process, 0, 0), process.executors.at(1).threads.size());
  };
  EXPECT_EQ(bands(70, 72, "0"), std::pair(std::vector{70, 71}, std::size_t{8}));
  EXPECT_EQ(bands(99, 98, "0"), std::pair(std::vector{99}, std::size_t{1}));
  EXPECT_EQ(bands(70, 70, "0"), std::pair(std::vector{70}, std::size_t{1}));
  EXPECT_EQ(bands(98, 70, "1"), std::pair(std::vector{98, 99}, std::size_t{8}));
}

// Inside a band in the file it was an error; one that a group's priority, or Takt, gives a thread
// was not seen.
TEST(CpuTraps, AThreadInsideABandHasNoBound) {
  const auto why_not = [](int priority) {
    return bound_of(fmt::format(R"(
threads:
  band: {{policy: SCHED_FIFO, priority: 60..68, affinity: [0]}}
  entry: {{policy: SCHED_FIFO, priority: 80, affinity: [0]}}
executors:
  e: {{type: preemptive, threads: [band]}}
  f: {{type: isolated, per: group, threads: [entry]}}
chains: [{{name: c, deadline: 90ms, path: [z/z_timer]}}]
container:
  components:
    - {{component: takt::Workload, name: x, executor: e, parameters: {{publishers: {{topic: [x], period_us: [100000], work_us: [10000]}}}}}}
    - {{component: takt::Workload, name: z, executor: f, parameters: {{publishers: {{topic: [z], period_us: [50000], work_us: [1000]}}}}, callback_groups: {{default: {{priority: {}}}}}}}
)",
                                priority))
        .why_not;
  };
  EXPECT_EQ(why_not(69), "");
  EXPECT_EQ(why_not(59), "");
  EXPECT_THAT(why_not(61), HasSubstr("inside the other's band"));
  EXPECT_THAT(why_not(68), HasSubstr("inside the other's band"));
}

/// A timer sends to two; one of them ends the instance, beside the chain.
std::string with_abort(const std::string& chain) {
  return R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
executors: {e: {type: events, threads: [a]}}
chains: [{name: c, deadline: 40ms, path: [s/x_timer, brake/x])" +
         chain + R"(}]
container:
  components:
    - {component: takt::Workload, name: s, executor: e, parameters: {publishers: {topic: [x], period_us: [50000], work_us: [1000]}}}
    - {component: takt::Workload, name: log, executor: e, parameters: {subscriptions: {topic: [x], work_us: [3000]}}, callbacks: {x: {deadline: 2ms, overrun: abort}}}
    - {component: takt::Workload, name: brake, executor: e, parameters: {subscriptions: {topic: [x], work_us: [5000]}}}
)";
}

// "Guaranteed for 1 of 1 instances at least", and none came.
TEST(CpuTraps, WhoEndsInstancesBesideAChainMayEndEach) {
  EXPECT_EQ(verdict_of(with_abort("")), Verdict::may_lose);
  const ModelBounds::Chain allowed = bound_of(with_abort(", losses: allowed"));
  EXPECT_EQ(allowed.one_of, 0);
  EXPECT_THAT(allowed.why_lossy, HasSubstr("'/log/x' may take longer than 2ms"));
}

// "1 of 2 instances at least", and none came: another publisher's messages replaced them all.
TEST(CpuTraps, WhatIsOverwrittenMayAlwaysBeOfOneSource) {
  const auto one_of = [](const char* other) {
    return bound_of(fmt::format(R"(
threads: {{a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}}}
executors: {{e: {{type: events, threads: [a]}}, f: {{type: events, threads: [b]}}}}
chains: [{{name: c, deadline: 90ms, losses: allowed, path: [s/x_timer, k/x]}}]
container:
  components:
    - {{component: takt::Workload, name: s, executor: e, parameters: {{publishers: {{topic: [x], period_us: [5000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: t, executor: e, parameters: {{publishers: {{topic: [{}], period_us: [20000], work_us: [6000]}}}}}}
    - {{component: takt::Workload, name: k, executor: f, parameters: {{subscriptions: {{topic: [x], work_us: [100], depth: [1]}}}}}}
)",
                                other))
        .one_of;
  };
  EXPECT_GT(one_of("other"), 1);
  EXPECT_EQ(one_of("x"), 0);
}

// The model itself had 150 executions of the first callback, and 30 instances.
TEST(CpuTraps, AChainThatLostInstancesInItsRunIsRefuted) {
  const std::string text = two_threads("", "policy: SCHED_FIFO, priority: 60, affinity: [1]",
                                       "policy: SCHED_FIFO, priority: 60, affinity: [0]");
  MeasuredModel measured{.duration = 15s};
  measured.callbacks.push_back(
      {.name = "/x/x_timer", .executions = 150, .least_distances = {100ms}});
  measured.chains.push_back({.name = "c", .instances = 148, .longest = 10ms});
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
  measured.chains[0].instances = 145;
  EXPECT_EQ(verdict_of(text, &measured), Verdict::refuted);
  const Analyzed found = analyzed(text, &measured);
  EXPECT_EQ(why_lost_in_run(found.chain(), found.bound()),
            "of 150 instances that began in the measured run, 145 came through");
  measured.lost_executions = 1;  // then they are not known
  EXPECT_EQ(verdict_of(text, &measured), Verdict::guaranteed);
}

// A container refuses to load what takes a guarantee away, by the model that its file names.
TEST(CpuTraps, AChainRestsOnTheModelThatItsContainerKnows) {
  const auto text = [](const char* path) {
    const MeasuredModel measured{.path = path, .duration = 15s};
    return analyzed("dds: {}\n" + two_threads("", "policy: SCHED_FIFO, priority: 60, affinity: [1]",
                                              "policy: SCHED_FIFO, priority: 60, affinity: [0]"),
                    &measured)
        .text_of("nothing_is_changed");
  };
  EXPECT_THAT(text(""), HasSubstr("no container unloads a component"));
  EXPECT_THAT(text("other.model.yaml"), HasSubstr("no container gets or unloads a component"));
}

// Each process has its own thread of that name.
TEST(CpuTraps, ThreadsAreNamedWithTheirProcesses) {
  const ModelBounds::Chain found = bound_of(R"(
machine: {cpus: [0]}
threads: {a: {policy: SCHED_FIFO, priority: 50..51, affinity: [0]}}
executors: {e: {type: preemptive, threads: [a]}}
chains: [{name: c, path: [x/x_timer]}]
containers:
  - {name: p, components: [{component: takt::Workload, name: x, executor: e, parameters: {publishers: {topic: [x], period_us: [50000], work_us: [1000]}}}]}
  - {name: q, components: [{component: takt::Workload, name: z, executor: e, parameters: {publishers: {topic: [z], period_us: [50000], work_us: [1000]}}}]}
)");
  EXPECT_THAT(found.why_not, HasSubstr("thread 'p/a-50' may run on the CPU of thread 'q/a-50'"));
}

// The same of an instance that a join waits for.
TEST(CpuTraps, WhoEndsInstancesOfAnInputEndsAJoin) {
  const ModelBounds::Chain found = bound_of(R"(
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}}
executors: {e: {type: events, threads: [a]}}
chains: [{name: c, deadline: 140ms, losses: allowed, path: [s/x_timer, j/x, k/z]}]
container:
  components:
    - {component: takt::Workload, name: s, executor: e, parameters: {publishers: {topic: [x], period_us: [50000], work_us: [1000]}}}
    - {component: takt::Workload, name: o, executor: e, parameters: {publishers: {topic: ["y"], period_us: [50000], work_us: [1000]}}}
    - {component: takt::Workload, name: log, executor: e, parameters: {subscriptions: {topic: ["y"], work_us: [3000]}}, callbacks: {"y": {deadline: 2ms, overrun: abort}}}
    - {component: takt::Workload, name: j, executor: e, parameters: {relays: {input: [x, "y"], output: [z, z], work_us: [500, 500], depth: [1, 1]}}}
    - {component: takt::Workload, name: k, executor: e, parameters: {subscriptions: {topic: [z], work_us: [500]}}}
)");
  EXPECT_EQ(found.one_of, 0);
  EXPECT_THAT(found.why_lossy, HasSubstr("waits for '/j/y': '/log/y' may take longer than 2ms"));
}

// ---- Overheads ----

/// Two callbacks of one process and one of another, which send to each other; `e` and `f` are the
/// executors of the first process.
std::string overheads_of(const std::string& prices, const std::string& threads,
                         const std::string& e, const std::string& f) {
  return fmt::format(R"(
machine: {{cpus: [0, 1], exclusive: true, overheads: {{{}}}}}
threads: {{{}, c: {{policy: SCHED_FIFO, priority: 9, affinity: [1]}}}}
executors: {{e: {}, f: {}, g: {{type: events, threads: [c]}}}}
topics: {{/m: {{delay: 1ms}}}}
chains: [{{name: c, deadline: 900ms, path: [l/l_timer, r/l]}}]
containers:
  - name: p
    components:
      - {{component: takt::Workload, name: l, executor: e, callbacks: {{l_timer: {{priority: 2, deadline: 90ms}}}}, parameters: {{publishers: {{topic: [l], period_us: [100000], work_us: [10000], size_bytes: [1000000]}}}}}}
      - {{component: takt::Workload, name: h, executor: f, callbacks: {{h_timer: {{priority: 3, deadline: 9ms}}}}, parameters: {{publishers: {{topic: [h], period_us: [20000], work_us: [1000]}}}}}}
      - {{component: takt::Workload, name: r, executor: e, callbacks: {{l: {{priority: 1}}}}, parameters: {{subscriptions: {{topic: [l], work_us: [1000]}}}}}}
      - {{component: takt::Workload, name: s, executor: e, callbacks: {{l: {{priority: 1}}}}, parameters: {{relays: {{input: [l], output: [m], work_us: [1000]}}}}}}
  - {{name: q, components: [{{component: takt::Workload, name: t, executor: g, parameters: {{subscriptions: {{topic: [m], work_us: [1000]}}}}}}]}}
)",
                     prices, threads, e, f);
}

/// The threads `a` and `b`, and two executors on them.
struct Placing {
  const char *threads, *e, *f;
};
constexpr const char* kTogether =
    "a: {policy: SCHED_FIFO, priority: 50, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, "
    "affinity: [0]}";
constexpr const char* kApart =
    "a: {policy: SCHED_FIFO, priority: 50, affinity: [0]}, b: {policy: SCHED_FIFO, priority: 60, "
    "affinity: [1]}";
constexpr const char* kBand =
    "a: {policy: SCHED_FIFO, priority: 50..55, affinity: [0]}, b: {policy: SCHED_FIFO, priority: "
    "60, affinity: [1]}";
constexpr Placing kPlacings[] = {
    {kTogether, "{type: events, threads: [a]}", "{type: events, threads: [b]}"},
    {kTogether, "{type: single_threaded, threads: [a]}", "{type: isolated, threads: [b]}"},
    {kApart, "{type: events, threads: [a]}", "{type: events, threads: [b]}"},
    {kApart, "{type: multi_threaded, threads: [a, b]}", "{type: events}"},
    {kApart, "{type: triggered, let: 100ms, threads: [a]}", "{type: events, threads: [b]}"},
    {"a: {policy: SCHED_FIFO, priority: 50, affinity: [0, 1]}, b: {policy: SCHED_FIFO, priority: "
     "60, affinity: [0]}",
     "{type: events, threads: [a]}", "{type: events, threads: [b]}"},
    {"a: {policy: SCHED_RR, priority: 50, affinity: [0]}, b: {policy: SCHED_RR, priority: 50, "
     "affinity: [0]}",
     "{type: events, threads: [a]}", "{type: events, threads: [b]}"},
    {"a: {policy: SCHED_DEADLINE, runtime: 40ms, period: 50ms}, b: {policy: SCHED_DEADLINE, "
     "runtime: 4ms, period: 10ms}",
     "{type: events, threads: [a]}", "{type: events, threads: [b]}"},
    {kBand, "{type: preemptive, threads: [a]}", "{type: events, threads: [b]}"},
    {kBand, "{type: preemptive, scheduler: edf, threads: [a]}", "{type: events, threads: [b]}"}};

constexpr const char* kOverheads[] = {"dispatch", "wake", "switch"};
constexpr const char* kPublishing[] = {"message", "receiver", "megabyte"};

/// All prices are 1 us, but for this one; empty: it is left out.
std::string prices_with(const std::string& changed, const std::string& instead) {
  std::string all, publishing;
  const auto add = [&](std::string& to, const std::string& name) {
    const std::string price = name == changed ? instead : "1us";
    if (!price.empty()) to += fmt::format("{}: {}, ", name, price);
  };
  for (const char* const name : kOverheads) add(all, name);
  for (const char* const name : kPublishing) add(publishing, name);
  return all + (changed == "message" && instead.empty() ? "" : "publish: {" + publishing + "}");
}

// A band that changes its threads was guaranteed without `switch`, and so was a message of a
// megabyte without `megabyte`: what makes a bound longer, and nobody states, is named.
TEST(CpuTraps, AnOverheadThatCountsAndIsLeftOutIsNamed) {
  int counted = 0;
  for (const Placing& placing : kPlacings) {
    const auto found = [&](const std::string& price, const std::string& instead) {
      // Its wake-ups are known: a file without `wake` has the change to a thread in these.
      const MeasuredModel run{.wake_overhead = {.longest = 1us}};
      return analyzed(
          overheads_of(prices_with(price, instead), placing.threads, placing.e, placing.f),
          price == "wake" ? nullptr : &run);
    };
    for (const std::string price :
         {"dispatch", "wake", "switch", "message", "receiver", "megabyte"}) {
      const Analyzed without = found(price, "");
      const auto longest = found(price, "200us").bound().bound;
      if (!without.bound().bound || longest == without.bound().bound) continue;
      ++counted;
      const std::string where = price + " of " + placing.threads + ", " + placing.e;
      EXPECT_NE(without.text_of("overheads_are_zero"), "") << where;
      // A stated 0 is stated.
      const Analyzed zero = found(price, "0ns"), little = found(price, "1ns");
      EXPECT_EQ(zero.text_of("overheads_are_zero"), little.text_of("overheads_are_zero")) << where;
      EXPECT_LE(*little.bound().bound - *zero.bound().bound, 1us) << where;
      // Nothing else is left out with it: without `wake`, a `switch` did not count at wake-ups.
      if (price != "message")
        EXPECT_GE(*without.bound().bound + 1us, *little.bound().bound) << where;
    }
  }
  EXPECT_GT(counted, 30);
}

// With `let` it had the bound of `any`.
TEST(CpuTraps, ATriggerThatMayWaitForEverHasNoBound) {
  for (const std::string trigger : {"any", "all"}) {
    const Analyzed found = analyzed(overheads_of(
        prices_with("", ""), kApart,
        fmt::format("{{type: triggered, let: 100ms, trigger: {}, threads: [a]}}", trigger),
        "{type: events, threads: [b]}"));
    const auto& executors = found.model.system.executors;
    EXPECT_EQ(std::any_of(executors.begin(), executors.end(),
                          [](const auto& each) { return each.unknown.starts_with("its trigger"); }),
              trigger == "all");
  }
}

// A `wake` of 1 us was believed beside a run in which none took less than 11.
TEST(CpuTraps, AnOverheadBelowAllThatWereMeasuredIsRefuted) {
  const auto refuted = [](const MeasuredModel& run) -> std::string {
    const Analyzed found =
        analyzed(overheads_of(prices_with("", ""), kApart, "{type: events, threads: [a]}",
                              "{type: events, threads: [b]}"),
                 &run);
    for (const Assumption& each : found.model.assumptions) {
      if (each.state == Assumption::State::refuted) return each.text;
    }
    return "";
  };
  EXPECT_THAT(refuted({.wake_overhead = {.least = 11us, .longest = 20us}}),
              HasSubstr("longer than stated, each time: waking a thread"));
  EXPECT_THAT(refuted({.dispatch_overhead = {.least = 2us, .longest = 2us}}),
              HasSubstr("each time: an executor's way"));
  EXPECT_EQ(refuted({.wake_overhead = {.least = 2us, .longest = 20us}}), "");
}

// Without `wake` the model's counts, and of the switches only those beside it.
TEST(CpuTraps, ASwitchBesideAMeasuredWakeIsNamed) {
  const MeasuredModel run{.wake_overhead = {.longest = 1us}};
  int counted = 0;
  for (const Placing& placing : kPlacings) {
    const auto found = [&](const char* change) {
      return analyzed(overheads_of(fmt::format("dispatch: 1us, {}publish: {{message: 1us, "
                                               "receiver: 1us, megabyte: 1us}}",
                                               change),
                                   placing.threads, placing.e, placing.f),
                      &run);
    };
    const Analyzed without = found("");
    if (!without.bound().bound || found("switch: 200us, ").bound().bound == without.bound().bound)
      continue;
    ++counted;
    EXPECT_THAT(without.text_of("overheads_are_zero"), HasSubstr("a change from thread to thread"))
        << placing.threads << ", " << placing.e;
  }
  EXPECT_GT(counted, 4);
}

// The other way round: a measured `wake` has the change to the thread in it.
TEST(CpuTraps, AThreadWithACpuOfItsOwnChangesWhenItWakes) {
  const auto text = [](const char* overheads, const MeasuredModel* run) {
    return analyzed(two_threads(fmt::format("rt_runtime: unlimited, overheads: {{{}publish: 1us}}",
                                            overheads),
                                "policy: SCHED_FIFO, priority: 60, affinity: [1]",
                                "policy: SCHED_FIFO, priority: 60, affinity: [0]"),
                    run)
        .text_of("overheads_are_zero");
  };
  const MeasuredModel run{.dispatch_overhead = {.longest = 1us}, .wake_overhead = {.longest = 1us}};
  EXPECT_EQ(text("", &run), "");
  EXPECT_EQ(text("dispatch: 1us, wake: 1us, switch: 1us, ", nullptr), "");
  EXPECT_THAT(text("dispatch: 1us, wake: 1us, ", nullptr), HasSubstr("a change from thread"));
  EXPECT_EQ(text("dispatch: 0ns, wake: 0ns, switch: 0ns, ", nullptr), "");
}

// A stated 0 is a promise as any other: a run refutes it.
TEST(CpuTraps, AnOverheadThatIsSaidToBeZeroIsRefuted) {
  const MeasuredModel run{.dispatch_overhead = {.least = 1us, .longest = 2us},
                          .wake_overhead = {.least = 1us, .longest = 2us}};
  const auto is_refuted = [&](const char* overheads) {
    const std::string thread = "policy: SCHED_FIFO, priority: 60, affinity: [0]";
    const std::string machine = fmt::format("overheads: {{{}}}", overheads);
    return verdict_of(two_threads(machine, thread, thread), &run) == Verdict::refuted;
  };
  EXPECT_TRUE(is_refuted("dispatch: 0ns, wake: 2us, switch: 0ns"));
  EXPECT_TRUE(is_refuted("dispatch: 2us, wake: 0ns, switch: 0ns"));
  EXPECT_FALSE(is_refuted("dispatch: 2us, wake: 0ns, switch: 1us"));
}

// ---- Speeds ----

// A slow CPU and half the work take as long as a fast one and all of it, if each time that the
// clock measures is the same. A `budget` was divided by the speed.
TEST(CpuTraps, OnlyWorkScalesWithTheSpeed) {
  const auto bounds = [](const char* speed, int work_us, const std::string& callback) {
    const Analyzed found = analyzed(fmt::format(
        R"(
machine: {{cpus: [0, 1], rt_runtime: unlimited, exclusive: true, speed: {{0: {0}, 1: {0}}}, overheads: {{dispatch: {1}us, wake: 7us, publish: {{message: {1}us, receiver: {1}us}}}}}}
threads: {{a: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, b: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}, r: {{policy: SCHED_FIFO, priority: 40, affinity: [0]}}}}
executors:
  e: {{type: events, threads: [a], spin: 50us}}
  l: {{type: triggered, let: 10ms, threads: [b]}}
  d: {{type: events, threads: [r]}}
topics: {{/x: {{lifespan: 30ms}}}}
chains: [{{name: c, deadline: 90ms, path: [x/x_timer, z/x]}}]
modes: {{m: {{drop: [v/v_timer], on: {{overrun: x/x_timer}}}}}}
container:
  components:
    - {{component: takt::Workload, name: x, executor: e, callbacks: {{x_timer: {{{2}}}}}, parameters: {{publishers: {{topic: [x], period_us: [20000], work_us: [{3}]}}}}}}
    - {{component: takt::Workload, name: z, executor: l, callbacks: {{x: {{waits: 50us}}}}, parameters: {{subscriptions: {{topic: [x], work_us: [{3}]}}}}}}
    - {{component: takt::Workload, name: v, executor: d, parameters: {{publishers: {{topic: [v], period_us: [40000], work_us: [{3}]}}}}}}
)",
        speed, work_us / 100, callback, work_us));
    std::string result = fmt::format("{} {}", to_string(found.verdict()), found.bound().why_lossy);
    for (const auto& callback_bound : found.bounds.all.callbacks)
      result += fmt::format(" {}", callback_bound.bound);
    return result;
  };
  for (const char* const callback :
       {"", "budget: 1ms", "budget: 2ms", "budget: 3ms", "deadline: 1ms", "deadline: 3ms",
        "budget: 1500us, overrun: abort", "budget: 3ms, overrun: abort",
        "deadline: 9ms, overrun: skip"}) {
    const std::string whole = bounds("1", 2000, callback);
    EXPECT_THAT(whole, ::testing::Not(HasSubstr(std::to_string(analysis::kUnbounded)))) << callback;
    EXPECT_EQ(bounds("0.5", 1000, callback), whole) << callback;
  }
}

// An overrun of each execution leads to a mode, which was guaranteed never to come.
TEST(CpuTraps, ABudgetIsAsLongOnASlowCpu) {
  const auto found = [](const char* speed, const char* limit) {
    std::string text = two_threads(fmt::format("speed: {{1: {}}}", speed),
                                   "policy: SCHED_FIFO, priority: 60, affinity: [1]",
                                   "policy: SCHED_FIFO, priority: 60, affinity: [0]");
    text.insert(text.find("container:"),
                "modes: {m: {drop: [z/z_timer], on: {overrun: x/x_timer}}}\n");
    text.insert(text.find("parameters: {publishers: {topic: [x]"),
                fmt::format("callbacks: {{x_timer: {{{}}}}}, ", limit));
    return analyzed(text, nullptr, /*accepts_all=*/true);
  };
  EXPECT_EQ(found("1", "budget: 15ms").verdict(), Verdict::guaranteed);
  EXPECT_EQ(found("0.5", "budget: 25ms").verdict(), Verdict::guaranteed);
  for (const char* const limit : {"budget: 15ms", "deadline: 15ms"}) {
    const Analyzed slow = found("0.5", limit);
    EXPECT_EQ(slow.verdict(), Verdict::refuted) << limit;
    EXPECT_THAT(slow.text_of("nothing_is_changed"), HasSubstr("takes 20ms or more")) << limit;
  }
}

}  // namespace
}  // namespace takt::test
