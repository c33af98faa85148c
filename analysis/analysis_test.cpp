// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/analysis.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/analysis/method.hpp"
#include "takt/base/error.hpp"
#include "takt/testing/oracle.hpp"
#include "takt/testing/random_system.hpp"

namespace takt::analysis {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Task {
  Time execution, period, deadline = 0;
};

/// One executor of one thread, with a timer for each task; the first is the most urgent.
System tasks(const std::vector<Task>& tasks, Order order) {
  System system{.executors = {{.name = "executor", .order = order}}};
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    system.callbacks.push_back({.name = "task_" + std::to_string(i),
                                .execution = tasks[i].execution,
                                .least_execution = tasks[i].execution,
                                .arrivals = ArrivalCurve::periodic(tasks[i].period),
                                .is_timer = true,
                                .urgency = -static_cast<std::int64_t>(i),
                                .point = tasks[i].deadline,
                                .place = i,
                                .group = i});
  }
  return system;
}

/// By this method alone.
std::vector<Time> bounds(const System& system, const std::string& method) {
  std::vector<Time> result;
  for (const CallbackBound& bound : analyze(system, {.methods = {method}}).callbacks) {
    result.push_back(bound.bound);
  }
  return result;
}

// Davis et al. 2007 and the crate response-time-analysis have these figures.
TEST(Analysis, NonPreemptiveFixedPrioritiesAsPublished) {
  EXPECT_THAT(bounds(tasks({{20, 70}, {20, 80}, {35, 200}}, Order::by_urgency), "urgency"),
              ElementsAre(54, 74, 75));
  EXPECT_THAT(bounds(tasks({{2, 8}, {3, 12}, {4, 16}}, Order::by_urgency), "urgency"),
              ElementsAre(5, 8, 9));
}

TEST(Analysis, NonPreemptiveDeadlinesAndArrivalAsPublished) {
  const std::vector<Task> set{{79, 120, 50}, {11, 34, 100}, {1, 190, 120}};
  EXPECT_THAT(bounds(tasks(set, Order::by_point), "points"), ElementsAre(89, 90, 121));
  EXPECT_THAT(bounds(tasks({{2, 8, 8}, {3, 12, 12}, {4, 16, 16}}, Order::by_point), "points"),
              ElementsAre(5, 8, 9));
  EXPECT_THAT(bounds(tasks(set, Order::by_arrival), "points"), ElementsAre(91, 91, 91));
}

// Three callbacks of 1, 2 and 3 every 25, beside two tasks of 3 every 20 with a jitter of 25.
System a_chain_and_two_tasks() {
  System system = tasks({{1, 25}, {3, 20}, {3, 20}}, Order::arbitrary);
  for (const std::size_t late : {1, 2}) {
    system.callbacks[late].arrivals = ArrivalCurve::periodic(20, 25);
  }
  for (const Time execution : {2, 3}) {
    system.callbacks.push_back(
        {.name = "next", .execution = execution, .least_execution = execution});
  }
  system.callbacks[0].outputs = {{.to = 3}};
  system.callbacks[3].outputs = {{.to = 4}};
  system.chains = {{"chain", {0, 3, 4}}};
  return system;
}

TEST(Analysis, AChainInOneExecutorAsPublished) {
  System system = a_chain_and_two_tasks();
  EXPECT_EQ(analyze(system).chains[0].bound, 24);
  system.executors[0].reservation = {.budget = 3, .period = 5};
  EXPECT_EQ(analyze(system).chains[0].bound, 72);
}

// What is due just after the polling point waits for the whole snapshot, though its priority is
// larger.
TEST(Analysis, APriorityDoesNotOvertakeInASnapshot) {
  System system = tasks({{2, 100}, {3, 200}, {4, 200}, {5, 200}}, Order::by_urgency);
  EXPECT_EQ(analyze(system).callbacks[0].bound, 6);
  system.executors[0].is_wait_set = true;
  EXPECT_EQ(analyze(system).callbacks[0].bound, 14);
  EXPECT_EQ(bounds(system, "urgency")[0], kUnbounded);
}

// A bound left out what Linux takes from real-time threads that want more than it grants.
TEST(Analysis, ThrottlingIsCharged) {
  System system = tasks({{8, 10}}, Order::by_arrival);
  system.for_realtime = Reservation{.budget = 87, .period = 100};
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(8));  // it is no real-time thread
  system.executors[0].is_realtime = true;
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(21));  // 88 may be wanted in 100
  system.may_come_twice = true;
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(8 + 2 * 13));
  system.for_realtime->budget = 88;
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(8));
}

TEST(Analysis, SpinningIsWorkForThoseBelow) {
  System system = tasks({{1, 10}, {2, 50}}, Order::by_arrival);
  system.executors.push_back(system.executors[0]);
  system.callbacks[0].executor = 1;
  system.executors[0].share = Executor::Share{{0}, 1};
  system.executors[1].share = Executor::Share{{0}, 2};
  EXPECT_EQ(bounds(system, "work_conserving")[1], 3);
  system.executors[1].early_wake = 3;
  EXPECT_EQ(bounds(system, "work_conserving")[1], 2 + 2 * 4 + 3);
  system.executors[1].spin = kUnbounded;
  EXPECT_EQ(bounds(system, "work_conserving")[1], kUnbounded);
}

/// A thread for each, on two CPUs; the first is the most urgent.
System threads(const std::vector<Task>& each) {
  System system = tasks(each, Order::by_arrival);
  system.executors.resize(each.size());
  for (std::size_t i = 0; i < each.size(); ++i) {
    system.callbacks[i].executor = i;
    system.executors[i].share =
        Executor::Share{{0, 1}, static_cast<int>(each.size()) - static_cast<int>(i)};
  }
  return system;
}

// By hand: while it waits, all CPUs run more urgent ones, or the reservation, whose most is 2 × 1
// and a tenth.
TEST(Analysis, AThreadWaitsOnlyWhileAllItsCpusAreTaken) {
  System system = threads({{4, 100}, {4, 100}, {4, 100}});
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(4, 4, 8));
  system.executors.push_back({.name = "reserved", .reservation = Reservation{1, 10}});
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(4, 7, 9));
  system.executors[2].share->cpus = {1};
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(4, 7, 15));
  system.executors[1].share->priority = 1;
  EXPECT_THAT(bounds(system, "work_conserving"), ElementsAre(4, kUnbounded, kUnbounded));
}

// What is left over of their work when it arrives, too.
TEST(Analysis, AThreadWaitsForWhatOthersHaveLeftOver) {
  EXPECT_THAT(bounds(threads({{4, 10}, {4, 10}, {4, 100}}), "work_conserving"),
              ElementsAre(4, 4, 12));
}

TEST(Analysis, AThreadOfAPoolSharesTheWorkOfTheOthers) {
  System pool = tasks({{4, 10}, {4, 10}, {4, 10}}, Order::by_arrival);
  pool.executors[0].threads = 2;
  for (std::size_t i = 0; i < 3; ++i) pool.callbacks[i].group = i;
  EXPECT_THAT(bounds(pool, "workload"), ElementsAre(8, 8, 8));
  pool = tasks({{4, 20}, {4, 20}, {4, 20}}, Order::by_arrival);
  pool.executors[0].threads = 2;
  pool.callbacks[2].group = 1;  // the last two exclude each other
  EXPECT_THAT(bounds(pool, "workload"), ElementsAre(8, 10, 10));
  pool = tasks({{2, 4}, {2, 4}, {2, 20}}, Order::arbitrary);  // two of each come while it waits
  pool.executors[0].threads = 2;
  EXPECT_THAT(bounds(pool, "workload"), ElementsAre(4, 4, 6));
  pool = tasks({{4, 100}, {4, 100}}, Order::by_arrival);
  pool.executors[0].threads = 2;
  pool.overheads.wake = 3;  // of each thread, one after the other
  EXPECT_THAT(bounds(pool, "workload"), ElementsAre(4 + 2 + 6, 4 + 2 + 6));
}

TEST(Analysis, SaysWhyThereIsNoBound) {
  System pool = tasks({{7, 10}, {7, 10}, {7, 10}}, Order::by_urgency);
  pool.executors[0].threads = 2;
  const CallbackBound of_pool = analyze(pool).callbacks[0];
  EXPECT_EQ(of_pool.bound, kUnbounded);
  EXPECT_THAT(of_pool.why_not, HasSubstr("more work than time"));

  System silent = tasks({{1, 10}}, Order::by_urgency);
  silent.callbacks.push_back({.name = "lonely", .execution = 1});
  EXPECT_EQ(analyze(silent).callbacks[1].bound, kUnbounded);
  EXPECT_THAT(analyze(silent).callbacks[1].why_not, HasSubstr("makes 'lonely' ready"));
  EXPECT_EQ(analyze(silent).callbacks[0].bound, 1);

  silent.executors[0].unknown = "SCHED_OTHER shares its CPU";
  EXPECT_EQ(analyze(silent).callbacks[0].why_not, "SCHED_OTHER shares its CPU");

  // Of an equal thread on its CPU, which gets messages from it after an unknown time.
  System shared = tasks({{1, 10}}, Order::by_urgency);
  shared.callbacks[0].outputs = {{.to = 1, .delay = kUnbounded}};
  shared.callbacks.push_back({.name = "other", .executor = 1, .execution = 1});
  shared.executors.push_back(
      {.name = "equal", .order = Order::by_urgency, .share = Executor::Share{{0}, 50}});
  shared.executors[0].share = Executor::Share{{0}, 50};
  EXPECT_THAT(analyze(shared).callbacks[0].why_not,
              HasSubstr("messages from 'task_0' to 'other' take"));
}

TEST(Analysis, AnOverloadedSnapshotIsStillBounded) {
  System system = tasks({{7, 10}, {7, 10}}, Order::in_windows);
  system.executors[0].is_wait_set = true;
  EXPECT_THAT(bounds(system, "snapshots"), ElementsAre(14 + 7, 14 + 14));
}

// An input waits for the end of a period, an output for that of the next.
TEST(Analysis, LogicalExecutionTimeTakesAPeriodForEachStep) {
  System system = a_chain_and_two_tasks();
  system.executors[0].let_period = 20;
  constexpr Time kAll = 1 + 3 + 3 + 2 + 3;
  EXPECT_EQ(analyze(system).callbacks[0].bound, 20 + kAll);
  EXPECT_EQ(analyze(system).chains[0].bound, 3 * 20 + kAll);
  // To another executor they come no closer than a period, whatever the jitter of the inputs.
  system.executors.push_back({.name = "next"});
  system.callbacks[4].executor = 1;
  EXPECT_EQ(analyze(system).callbacks[4].bound, 3);
  EXPECT_EQ(analyze(system).chains[0].bound, 2 * 20 + 20 + 3);
  system.executors[0].let_period = 8;
  EXPECT_THAT(analyze(system).chains[0].why_not, HasSubstr("longer than the period"));
}

TEST(Analysis, SeveralMessagesWaitForSeveralPeriods) {
  System system = tasks({{1, 20}}, Order::arbitrary);
  system.callbacks[0].is_timer = false;
  system.executors[0].let_period = 10;
  EXPECT_EQ(bounds(system, "periods")[0], 10 + 1);
  system.callbacks[0].arrivals = ArrivalCurve::by_distances({0, 40});  // two at once
  EXPECT_EQ(bounds(system, "periods")[0], 20 + 1);
  system.callbacks[0].arrivals = ArrivalCurve::periodic(9);
  EXPECT_EQ(bounds(system, "periods")[0], kUnbounded);
}

TEST(Analysis, ReleasesThatWaitQueueAsMessagesDo) {
  System system = tasks({{1, 9}}, Order::arbitrary);
  system.executors[0].let_period = 10;
  EXPECT_EQ(bounds(system, "periods")[0], 10 + 1);
  system.callbacks[0].depth = 2;
  EXPECT_EQ(bounds(system, "periods")[0], kUnbounded);
  system.executors[0].let_period = 0;
  system.executors[0].is_wait_set = true;
  system.callbacks[0].depth.reset();
  system.callbacks[0].execution = 7;
  EXPECT_EQ(bounds(system, "snapshots")[0], 14);
  system.callbacks[0].depth = 2;
  EXPECT_EQ(bounds(system, "snapshots")[0], kUnbounded);
}

TEST(Analysis, SaysWhatABoundIsMissingFor) {
  System system{.executors = {{.name = "first", .unknown = "thread 'planning' is SCHED_OTHER"},
                              {.name = "second"},
                              {.name = "third"}},
                .callbacks = {{.name = "a",
                               .executor = 0,
                               .execution = 1,
                               .least_execution = 1,
                               .arrivals = ArrivalCurve::periodic(100),
                               .is_timer = true,
                               .outputs = {{.to = 1}}},
                              {.name = "b", .executor = 1, .execution = 1, .outputs = {{.to = 2}}},
                              {.name = "c", .executor = 2, .execution = 1}},
                .chains = {{.name = "last", .callbacks = {2}}}};
  EXPECT_EQ(analyze(system).chains[0].why_not,
            "third: messages come by way of 'first', and thread 'planning' is SCHED_OTHER");
  system.executors[0].unknown.clear();
  EXPECT_LT(analyze(system).chains[0].bound, kUnbounded);
  system.callbacks[1].outputs[0].delay = kUnbounded;
  system.callbacks[1].least_execution = 1;  // then it said that there was too much work
  EXPECT_THAT(analyze(system).callbacks[2].why_not, HasSubstr("messages from 'b' to 'c' take"));
  system.callbacks[1].outputs[0].delay = 0;
  system.callbacks[0].execution = 101;
  EXPECT_THAT(analyze(system).chains[0].why_not,
              HasSubstr("by way of 'first', and there is more work than time"));
  system.executors[0].let_period = 100;
  EXPECT_THAT(analyze(system).chains[0].why_not, HasSubstr("by way of 'first', and its callbacks"));
}

// 2000 timers were refused without a line, and 500 took 5 s.
TEST(Analysis, AThousandTimersOfAnExecutorAreQuick) {
  constexpr Time kTimers = 1000 / kFewerSanitized;
  std::vector<Task> many;
  for (Time i = 0; i < kTimers; ++i) many.push_back({1, 10'000 + 100 * (i % 20), 1000});
  for (const Order order : {Order::by_arrival, Order::by_point})
    EXPECT_EQ(bounds(tasks(many, order), "points").front(), kTimers);
  EXPECT_THROW(analyze(tasks(std::vector<Task>(20'000, {1, 100'000}), Order::by_arrival)),
               TooManyPaths);
}

TEST(Analysis, RefusesWhatIsNoSystem) {
  System circle = a_chain_and_two_tasks();
  circle.callbacks[4].outputs = {{.to = 3}};
  EXPECT_THROW(analyze(circle), Error);
  System unlinked = a_chain_and_two_tasks();
  unlinked.chains = {{"chain", {0, 4}}};
  EXPECT_THROW(analyze(unlinked), Error);
  EXPECT_THROW(analyze(a_chain_and_two_tasks(), {.methods = {"magic"}}), Error);

  const auto refuses = [](void (*spoil)(System&)) {
    System system = a_chain_and_two_tasks();
    spoil(system);
    EXPECT_THROW(analyze(system), Error);
  };
  refuses([](System& system) { system.executors[0].threads = 0; });
  refuses([](System& system) { system.executors[0].reservation = {.budget = 0, .period = 5}; });
  refuses([](System& system) { system.executors[0].reservation = {.budget = 6, .period = 5}; });
  refuses([](System& system) { system.callbacks[0].executor = 1; });
  refuses([](System& system) { system.callbacks[0].least_execution = 2; });
  refuses([](System& system) { system.callbacks[0].outputs[0].to = 5; });
  refuses([](System& system) { system.callbacks[0].outputs[0].messages = 0; });
  refuses([](System& system) { system.callbacks[0].outputs[0].least_delay = 1; });
  refuses([](System& system) { system.chains[0].callbacks = {}; });
  refuses([](System& system) { system.chains[0].callbacks = {5}; });
  refuses([](System& system) { system.callbacks[0].execution = kUnbounded + 1; });
}

// PiCAS, as published, finds 6 for B: it leaves out that A comes late, and so twice in short.
TEST(Analysis, WhatAnotherCpuDelaysComesWithJitter) {
  System system = tasks({{8, 20}, {1, 10}, {3, 50}}, Order::by_urgency);
  system.callbacks.push_back({.name = "after", .execution = 3, .least_execution = 3});
  system.callbacks[1].outputs = {{.to = 3}};
  const auto on = [](int cpu, int priority) { return Executor::Share{{cpu}, priority}; };
  system.executors = {{.name = "high", .share = on(0, 3)},
                      {.name = "first", .share = on(0, 2)},
                      {.name = "after", .share = on(1, 3)},
                      {.name = "low", .share = on(1, 2)}};
  system.callbacks[0].executor = 0;
  system.callbacks[1].executor = 1;
  system.callbacks[3].executor = 2;
  system.callbacks[2].executor = 3;
  EXPECT_EQ(analyze(system).callbacks[2].bound, 9);
  const auto worst = [&](std::size_t callback) { return system.callbacks[callback].execution; };
  const testing::Oracle run(system, {{0, 0, 9, 0}, worst, 20});
  const auto low = std::find_if(run.jobs().begin(), run.jobs().end(),
                                [](const auto& job) { return job->callback == 2; });
  ASSERT_NE(low, run.jobs().end());
  EXPECT_EQ((*low)->end - (*low)->ready, 9);
}

// Teper et al., "Thread Carefully", 2024: two threads, of four callbacks the last two in a group;
// in rclcpp the last one may never run, though there is time for all. Nothing is known of such a
// pool, but here a callback whose group works is parked, and has its turn.
TEST(Analysis, APoolInWhichRclcppStarvesACallback) {
  System system = tasks({{50, 100}, {50, 100}, {50, 100}, {1, 100}}, Order::in_windows);
  system.executors[0].is_wait_set = true;
  system.executors[0].threads = 2;
  system.callbacks[3].group = system.callbacks[2].group;
  for (const CallbackBound& bound : analyze(system).callbacks) {
    EXPECT_EQ(bound.bound, kUnbounded);
    EXPECT_THAT(bound.why_not, HasSubstr("more work than time"));
  }
  const auto worst = [&](std::size_t callback) { return system.callbacks[callback].execution; };
  const testing::Oracle run(system, {{0, 0, 0, 0}, worst, 10'000});
  const auto runs = std::count_if(run.jobs().begin(), run.jobs().end(),
                                  [](const auto& job) { return job->callback == 3; });
  EXPECT_GE(runs, 99);
}

System scaled(System system, Time by) {
  for (Executor& executor : system.executors) {
    if (!executor.reservation) continue;
    executor.reservation->budget *= by;
    executor.reservation->period *= by;
  }
  for (Callback& callback : system.callbacks) {
    callback.execution *= by;
    callback.least_execution *= by;
    if (callback.point < kUnbounded) callback.point *= by;
    if (callback.longest_gap < kUnbounded) callback.longest_gap *= by;
    if (callback.arrivals) {
      callback.arrivals = ArrivalCurve::periodic(callback.arrivals->least_distance(2) * by);
    }
  }
  for (Executor& executor : system.executors) executor.let_period *= by;
  for (Time* const overhead :
       {&system.overheads.dispatch, &system.overheads.wake, &system.overheads.context_switch}) {
    *overhead *= by;
  }
  return system;
}

// Methods that count no unit less than an execution, and divide nothing but a reservation's share.
TEST(Analysis, TimesScaleExactly) {
  const std::vector<std::string> exact{"periods", "snapshots", "work_conserving"};
  std::size_t bounds = 0;
  for (std::uint64_t seed = 1; seed <= 300 / kFewerSanitized; ++seed) {
    const testing::RandomSystem random(seed, {.has_overheads = true, .has_periods = true});
    const bool has_reservation =
        std::any_of(random.system.executors.begin(), random.system.executors.end(),
                    [](const Executor& executor) { return executor.reservation.has_value(); });
    const Bounds once = analyze(random.system, {.methods = exact, .limit = 100'000});
    const Bounds more = analyze(scaled(random.system, 7), {.methods = exact, .limit = 7 * 100'000});
    for (std::size_t i = 0; i < once.chains.size(); ++i) {
      if (once.chains[i].bound >= kUnbounded) continue;
      if (has_reservation) continue;
      EXPECT_EQ(more.chains[i].bound, 7 * once.chains[i].bound) << "seed " << seed;
      ++bounds;
    }
  }
  EXPECT_GE(bounds, 300 / kFewerSanitized);
}

// All times in another unit; only the blocking of one unit less than an execution is not scaled,
// and the work that several threads share is divided.
TEST(Analysis, TheUnitOfTimeDoesNotMatter) {
  for (std::uint64_t seed = 1; seed <= 200 / kFewerSanitized; ++seed) {
    const testing::RandomSystem random(seed, {});
    const bool has_threads =
        std::any_of(random.system.executors.begin(), random.system.executors.end(),
                    [](const Executor& executor) { return executor.threads > 1; });
    const Bounds once = analyze(random.system, {.limit = 100'000});
    const Bounds thousandfold = analyze(scaled(random.system, 1000), {.limit = 100'000'000});
    for (std::size_t i = 0; i < once.callbacks.size(); ++i) {
      const Time bound = once.callbacks[i].bound, more = thousandfold.callbacks[i].bound;
      if (bound >= kUnbounded || more >= kUnbounded) continue;
      const std::size_t divisions = has_threads ? random.system.callbacks.size() : 0;
      EXPECT_GE(more, (bound - static_cast<Time>(divisions)) * 1000) << "seed " << seed;
      EXPECT_LE(more, (bound + static_cast<Time>(random.system.callbacks.size()) * 40) * 1000)
          << "seed " << seed;
    }
  }
}

TEST(Analysis, MoreWorkOrJitterLowersNoBound) {
  for (std::uint64_t seed = 1; seed <= 300 / kFewerSanitized; ++seed) {
    testing::RandomSystem random(seed, {.has_outside = true, .has_periods = true});
    System more = random.system;
    Callback& one = more.callbacks[random.between(0, more.callbacks.size() - 1)];
    if (!one.outputs.empty() && !one.outputs[0].waits && random.is_one_of(3)) {
      ++one.outputs[0].messages;
    } else if (one.arrivals && random.is_one_of(2)) {
      one.arrivals = one.arrivals->with_jitter(7);
    } else {
      one.execution += 3;
    }
    const Bounds before = analyze(random.system, {.limit = 100'000});
    const Bounds after = analyze(more, {.limit = 100'000});
    for (std::size_t i = 0; i < more.callbacks.size(); ++i) {
      EXPECT_GE(after.callbacks[i].bound, before.callbacks[i].bound) << "seed " << seed;
    }
    for (std::size_t i = 0; i < more.chains.size(); ++i) {
      EXPECT_GE(after.chains[i].bound, before.chains[i].bound) << "seed " << seed;
    }
  }
}

TEST(Analysis, TermsAddUpToTheBound) {
  for (std::uint64_t seed = 1; seed <= 200 / kFewerSanitized; ++seed) {
    const testing::RandomSystem random(seed, {.has_overheads = true, .has_periods = true});
    const Options options{.limit = 100'000, .explains = true};
    for (const ChainBound& chain : analyze(random.system, options).chains) {
      for (const SegmentBound& segment : chain.segments) {
        if (segment.bound >= kUnbounded) continue;
        Time sum = 0;
        for (const Term& term : segment.terms) sum += term.time;
        EXPECT_EQ(sum, segment.bound) << "seed " << seed;
      }
    }
  }
}

// Of one timer of 3 every 20: each execution takes 1 longer, and the thread wakes up after 5.
TEST(Analysis, OverheadsAreCharged) {
  System system = tasks({{3, 20}}, Order::by_urgency);
  system.overheads = {.dispatch = 1, .wake = 5};
  EXPECT_EQ(analyze(system).callbacks[0].bound, 5 + 4);
  // Two switches for each execution of a more urgent thread of the CPU.
  system = tasks({{3, 20}, {4, 40}}, Order::by_urgency);
  system.executors = {{.name = "high", .share = Executor::Share{{0}, 2}},
                      {.name = "low", .share = Executor::Share{{0}, 1}}};
  system.callbacks[1].executor = 1;
  EXPECT_EQ(analyze(system).callbacks[1].bound, 4 + 3);
  system.overheads.context_switch = 2;
  EXPECT_EQ(analyze(system).callbacks[1].bound, 4 + 3 + 2 * 2);
}

}  // namespace
}  // namespace takt::analysis
