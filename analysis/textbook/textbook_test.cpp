// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/textbook/textbook.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/analysis/analysis.hpp"
#include "takt/base/error.hpp"

namespace takt::analysis::textbook {
namespace {

using ::testing::ElementsAre;

struct Bare {
  Time execution, period, deadline = 0, jitter = 0;
};

/// The first is the most urgent.
TaskSet set_of(const std::vector<Bare>& tasks) {
  TaskSet set{.limit = 100'000};
  for (const Bare& task : tasks) {
    set.tasks.push_back({.name = "task " + std::to_string(set.tasks.size()),
                         .execution = task.execution,
                         .last = task.execution,
                         .period = task.period,
                         .jitter = task.jitter,
                         .deadline = task.deadline,
                         .point = task.deadline,
                         .priority = -static_cast<std::int64_t>(set.tasks.size())});
  }
  return set;
}

std::vector<Time> bounds(const std::string& name, const TaskSet& set) {
  std::vector<Time> result;
  for (const Response& response : analyse(name, set).responses) result.push_back(response.bound);
  return result;
}

TaskSet on_three_of_five(TaskSet set) {
  set.reservation = {.budget = 3, .period = 5};
  return set;
}

TEST(Textbook, FixedPrioritiesAsPublished) {
  EXPECT_THAT(bounds("fp", set_of({{1, 4}, {1, 5}, {3, 9}, {3, 18}})), ElementsAre(1, 2, 7, 18));
  // Lehoczky: the longest is not that of the first release.
  EXPECT_THAT(bounds("fp", set_of({{26, 70}, {62, 100}})), ElementsAre(26, 118));
  EXPECT_THAT(bounds("np_fp", set_of({{20, 70}, {20, 80}, {35, 200}})), ElementsAre(54, 74, 75));
  EXPECT_THAT(bounds("np_fp", set_of({{2, 8}, {3, 12}, {4, 16}})), ElementsAre(5, 8, 9));
}

TEST(Textbook, DeadlinesAndArrivalAsPublished) {
  const TaskSet set = set_of({{79, 120, 50}, {11, 34, 100}, {1, 190, 120}});
  EXPECT_THAT(bounds("edf", set), ElementsAre(79, 101, 121));
  EXPECT_THAT(bounds("np_edf", set), ElementsAre(89, 90, 121));
  EXPECT_THAT(bounds("gel", set), ElementsAre(89, 90, 121));
  EXPECT_THAT(bounds("fifo", set), ElementsAre(91, 91, 91));
  EXPECT_THAT(
      bounds("edf", set_of({{1, 5, 5}, {100, 1000, 1000}, {2, 10, 10}, {5, 20, 45}, {10, 50, 50}})),
      ElementsAre(1, 694, 3, 22, 27));
  EXPECT_THAT(bounds("np_edf", set_of({{2, 8, 8}, {3, 12, 12}, {4, 16, 16}})),
              ElementsAre(5, 8, 9));
}

TEST(Textbook, DemandOfDeadlinesAsPublished) {
  const Result feasible = analyse("dbf", set_of({{2, 6, 5}, {2, 8, 7}, {3, 12, 10}}));
  EXPECT_EQ(feasible.is_schedulable, true);
  EXPECT_THAT(feasible.points,
              ElementsAre(std::pair(5, 2), std::pair(7, 4), std::pair(10, 7), std::pair(11, 9)));
  const Result infeasible = analyse("dbf", set_of({{3, 6, 4}, {3, 8, 5}}));
  EXPECT_EQ(infeasible.is_schedulable, false);
  EXPECT_THAT(infeasible.points, ::testing::Contains(std::pair(5, 6)));
}

TEST(Textbook, SupplyAsPublished) {
  TaskSet set{.reservation = Reservation{3, 5}, .until = 15};
  std::vector<Time> supplied;
  for (const auto& point : analyse("sbf", set).points) supplied.push_back(point.second);
  EXPECT_THAT(supplied, ElementsAre(0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 4, 5, 6, 6, 6, 7));
  set = {.reservation = Reservation{4, 10}, .until = 26};
  const auto points = analyse("sbf", set).points;
  EXPECT_EQ(points[13].second, 1);
  EXPECT_EQ(points[16].second, 4);
  EXPECT_EQ(points[22].second, 4);
  EXPECT_EQ(points[26].second, 8);
}

TEST(Textbook, ChainsOfRos2sFirstExecutorAsPublished) {
  TaskSet timers = on_three_of_five(set_of({{1, 10}, {3, 20}, {1, 10}}));
  for (Task& task : timers.tasks) task.is_timer = true;
  EXPECT_EQ(bounds("casini_timer", timers)[2], 12);
  timers.tasks[1].jitter = 10;
  EXPECT_EQ(bounds("casini_timer", timers)[2], 17);
  timers.tasks[1].jitter = 0;
  timers.tasks.push_back({.name = "subscription", .execution = 4, .last = 4, .period = 50});
  EXPECT_EQ(bounds("casini_timer", timers)[2], 20);
  EXPECT_NE(analyse("casini_timer", timers).responses[3].why_not, "");
  timers.tasks.pop_back();
  timers.blocking = 4;
  EXPECT_EQ(bounds("casini_timer", timers)[2], 20);

  EXPECT_EQ(bounds("casini_polling", on_three_of_five(set_of({{1, 10}, {1, 10}, {3, 20}})))[0], 12);
  EXPECT_THAT(bounds("casini_event_source", on_three_of_five(set_of({{2, 5, 0, 2}}))),
              ElementsAre(7));
  TaskSet chain = set_of({{6, 25}, {3, 20, 0, 25}, {3, 20, 0, 25}});
  chain.tasks[0].last = 3;
  EXPECT_EQ(bounds("wc", chain)[0], 24);
  EXPECT_EQ(bounds("wc", on_three_of_five(chain))[0], 72);
}

TEST(Textbook, PollingPointsAsPublished) {
  const TaskSet set = set_of({{10, 100}, {230, 10000}, {190, 1000}});
  EXPECT_THAT(bounds("blass_rr", set), ElementsAre(530, 440, 440));
  EXPECT_THAT(bounds("blass_bw", set), ElementsAre(430, 449, 449));
  TaskSet alone = set_of({{1, 100}});
  alone.reservation = {.budget = 3, .period = 5};
  EXPECT_THAT(bounds("blass_rr", alone), ElementsAre(5));
  EXPECT_THAT(bounds("blass_bw", alone), ElementsAre(5));
}

Task chain_of(Time period, std::vector<Task::Part> parts) {
  Task task{.name = "chain", .period = period, .parts = std::move(parts)};
  for (const Task::Part& part : task.parts) {
    task.execution += part.execution;
    task.last = part.execution;
  }
  return task;
}

TEST(Textbook, PriorityDrivenChains) {
  TaskSet set{.tasks = {chain_of(20, {{2, 0, 3}, {3, 0, 4}}), chain_of(50, {{4, 0, 1}, {6, 0, 2}})},
              .executors = {{.cpu = 0, .priority = 1}}};
  EXPECT_THAT(bounds("picas", set), ElementsAre(11, 15));
  set.executors = {{.cpu = 0, .priority = 2}, {.cpu = 0, .priority = 1}};
  for (Task::Part& part : set.tasks[1].parts) part.executor = 1;
  EXPECT_THAT(bounds("picas", set), ElementsAre(5, 15));
}

// What the first CPU delays comes twice in short to the second: 9 occurs for the last, see the
// tests of analyze().
TEST(Textbook, PriorityDrivenChainsAreOptimisticAcrossCpus) {
  const TaskSet set{.tasks = {chain_of(20, {{8, 0, 1}}), chain_of(10, {{1, 1, 1}, {3, 2, 1}}),
                              chain_of(50, {{3, 3, 1}})},
                    .executors = {{.cpu = 0, .priority = 2},
                                  {.cpu = 0, .priority = 1},
                                  {.cpu = 1, .priority = 2},
                                  {.cpu = 1, .priority = 1}}};
  EXPECT_EQ(bounds("picas", set)[2], 6);
}

// By hand: alone, a chain takes as long as its callbacks; with a more urgent one of 4 beside it on
// two threads, 2·(5 − 3) + (4 + 4) < 2Δ at 7, and that is the begin of the last 3.
TEST(Textbook, InstancesOfChainsByHand) {
  TaskSet set = set_of({{5, 20, 20}});
  set.tasks[0].last = 3;
  set.processors = 2;
  for (const char* name : {"cil_edf_constrained", "cil_edf_arbitrary"}) {
    EXPECT_THAT(bounds(name, set), ElementsAre(5)) << name;
  }
  set.tasks.push_back({.name = "urgent", .execution = 4, .last = 4, .period = 30, .deadline = 10});
  EXPECT_EQ(bounds("cil_edf_constrained", set)[0], 7 + 3 - 1);
  EXPECT_EQ(bounds("cil_edf_arbitrary", set)[0], 7 + 3 - 1);
  set.tasks[0].deadline = 21;
  EXPECT_THROW(analyse("cil_edf_constrained", set), Error);
}

TEST(Textbook, RefusesMoreThanThereIs) {
  for (const std::string& name : analyses().names()) {
    if (name == "sbf" || analyses().traits(name).bounds_some) continue;
    TaskSet set = set_of({{6, 10, 10}, {5, 10, 10}});
    EXPECT_THROW(analyse(name, set), Error) << name;
  }
  EXPECT_THROW(analyse("fp", on_three_of_five(set_of({{7, 10}}))), Error);
  EXPECT_THROW(analyse("rms", {}), Error);
  // All that there is, is not more.
  EXPECT_THAT(bounds("fp", set_of({{5, 10}, {10, 20}})), ElementsAre(5, 20));
  EXPECT_THAT(bounds("np_fp", set_of({{5, 10}, {10, 20}})), ElementsAre(14, 15));
}

// Every set with a total above 1 was refused, also where only the least urgent has no bound, or
// where each task has a CPU.
TEST(Textbook, BoundsWhatAnOverloadDoesNotReach) {
  TaskSet set = set_of({{6, 10, 10}, {5, 10, 10}});
  EXPECT_THAT(bounds("casini_event_source", set), ElementsAre(6, 5));
  set.tasks[0].priority = 2;
  set.tasks[1].priority = 1;
  EXPECT_THAT(bounds("fp", set), ElementsAre(6, kUnbounded));
  EXPECT_THAT(bounds("np_fp", set), ElementsAre(10, kUnbounded));
  for (Task& task : set.tasks) task.is_timer = true;
  EXPECT_THAT(bounds("casini_timer", set), ElementsAre(11, kUnbounded));
  set.tasks[0].parts = {{.execution = 6, .executor = 0, .priority = 1}};
  set.tasks[1].parts = {{.execution = 5, .executor = 1, .priority = 1}};
  set.executors = {{.cpu = 0, .priority = 2}, {.cpu = 1, .priority = 1}};
  EXPECT_THAT(bounds("picas", set), ElementsAre(6, 5));
  set.executors[1].cpu = 0;
  EXPECT_THAT(bounds("picas", set), ElementsAre(6, kUnbounded));
}

/// One executor of one thread with a timer for each task.
System system_of(const TaskSet& set, Order order) {
  System system{
      .executors = {{.name = "executor", .order = order, .reservation = set.reservation}}};
  for (const Task& task : set.tasks) {
    system.callbacks.push_back({.name = task.name,
                                .execution = task.execution,
                                .arrivals = task.arrivals(),
                                .is_timer = true,
                                .urgency = task.priority,
                                .point = *task.deadline});
  }
  return system;
}

// Written twice, they say the same.
TEST(Textbook, AgreesWithTheMethodsOfTakt) {
  std::mt19937_64 random(1);
  const auto between = [&](Time first, Time last) {
    return std::uniform_int_distribution<Time>(first, last)(random);
  };
  for (int round = 0; round < 500; ++round) {
    std::vector<Bare> tasks;
    for (Time i = between(1, 5); i > 0; --i) {
      const Time period = 10 * between(2, 12);
      tasks.push_back({between(1, period / 5), period, between(5, 2 * period), between(0, 30)});
    }
    TaskSet set = set_of(tasks);
    const auto agree = [&](const char* textbook, const char* method, Order order) {
      std::vector<Time> expected;
      const Options options{.methods = {method}, .limit = set.limit};
      for (const CallbackBound& bound : analyze(system_of(set, order), options).callbacks) {
        expected.push_back(bound.bound);
      }
      EXPECT_EQ(bounds(textbook, set), expected) << textbook << " in round " << round;
    };
    agree("np_fp", "urgency", Order::by_urgency);
    agree("np_edf", "points", Order::by_point);
    agree("gel", "points", Order::by_point);
    agree("fifo", "points", Order::by_arrival);
    agree("wc", "work_conserving", Order::arbitrary);
    set.reservation = {.budget = 9, .period = 10};
    double wanted = 0;
    for (const Bare& task : tasks) {
      wanted += static_cast<double>(task.execution) / static_cast<double>(task.period);
    }
    if (wanted > 0.9) continue;
    agree("np_fp", "urgency", Order::by_urgency);
    agree("wc", "work_conserving", Order::arbitrary);
  }
}

}  // namespace
}  // namespace takt::analysis::textbook
