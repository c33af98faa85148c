// Tests of virtual CPUs, with threads that do nothing but work.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/cpu_model.hpp"

#include <deque>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using Policy = CpuModel::Policy;
using ::testing::ElementsAre;

/// Threads with one piece of work each, in milliseconds; runs them all.
class Machine {
 public:
  struct Job {
    CpuModel::Thread thread;
    Nanoseconds begin{0}, amount{0};
    TimePoint end{};
    enum class State { before, at_work, done } state = State::before;
  };

  explicit Machine(CpuModel::Options options) : model_(std::move(options)) {}

  CpuModel::Thread& add(Policy policy, int priority, Nanoseconds begin, Nanoseconds amount) {
    Job& job = jobs_.emplace_back();
    job.thread.policy = policy;
    job.thread.priority = priority;
    job.begin = begin;
    job.amount = amount;
    return job.thread;
  }
  CpuModel::Thread& reserve(Nanoseconds runtime, Nanoseconds deadline, Nanoseconds period,
                            Nanoseconds begin, Nanoseconds amount) {
    CpuModel::Thread& thread = add(Policy::deadline, 0, begin, amount);
    thread.reservation = {runtime, deadline, period};
    return thread;
  }

  /// When each ends, in microseconds.
  std::vector<std::int64_t> ends() {
    while (step()) {
    }
    std::vector<std::int64_t> result;
    for (const Job& job : jobs_) result.push_back(job.end.time_since_epoch() / 1us);
    return result;
  }

 private:
  bool step() {
    Job* first = nullptr;
    TimePoint time = kNever;
    for (Job& job : jobs_) {
      const TimePoint next = job.state == Job::State::before ? TimePoint(job.begin)
                             : job.state == Job::State::done ? kNever
                                                             : model_.next_event(job.thread);
      if (next < time) std::tie(first, time) = std::tuple(&job, next);
    }
    if (model_.next_event() < time) {
      model_.happen(model_.next_event());
      return true;
    }
    if (first == nullptr) return false;
    if (first->state == Job::State::before) {
      first->state = Job::State::at_work;
      model_.wake(first->thread, time);
    } else if (model_.happen(first->thread, time)) {
      if (first->amount != 0ms) {
        model_.work(first->thread, std::exchange(first->amount, 0ms), time);
      } else {
        first->state = Job::State::done;
        first->end = time;
        model_.sleep(first->thread, time);
      }
    }
    return true;
  }

  CpuModel model_;
  std::deque<Job> jobs_;
};

CpuModel::Options cpus(std::size_t count) {
  CpuModel::Options options;
  for (std::size_t i = 0; i < count; ++i) options.cpus.push_back({.number = static_cast<int>(i)});
  return options;
}

TEST(CpuModel, AMoreUrgentThreadPreempts) {
  Machine machine(cpus(1));
  machine.add(Policy::fifo, 1, 0ms, 10ms);
  machine.add(Policy::fifo, 2, 4ms, 3ms);
  machine.add(Policy::fifo, 1, 1ms, 2ms);  // an equal one waits
  machine.add(Policy::other, 0, 0ms, 1ms);
  EXPECT_THAT(machine.ends(), ElementsAre(13000, 7000, 15000, 16000));
}

TEST(CpuModel, EqualThreadsOfRrTakeTurns) {
  Machine machine(cpus(1));
  machine.add(Policy::rr, 1, 0ms, 150ms);
  machine.add(Policy::rr, 1, 1ms, 120ms);
  EXPECT_THAT(machine.ends(), ElementsAre(250000, 270000));
}

TEST(CpuModel, AThreadStaysUnlessAMoreUrgentOneComes) {
  Machine machine(cpus(2));
  machine.add(Policy::fifo, 5, 0ms, 10ms);            // on 0
  machine.add(Policy::fifo, 4, 1ms, 10ms);            // on 1
  machine.add(Policy::fifo, 9, 2ms, 2ms).cpus = {0};  // the first one moves, the second one waits
  machine.add(Policy::fifo, 1, 3ms, 1ms).cpus = {1};
  EXPECT_THAT(machine.ends(), ElementsAre(10000, 13000, 4000, 11000));
}

// The first may have 2 of 10 ms: it does not delay the other one by more, however much it wants.
TEST(CpuModel, AReservationGetsItsBudgetAndNoMore) {
  Machine machine(cpus(1));
  machine.reserve(2ms, 10ms, 10ms, 0ms, 7ms);
  machine.reserve(5ms, 20ms, 20ms, 0ms, 9ms);
  machine.add(Policy::fifo, 99, 0ms, 2ms);
  // 0-2, then 10-12, 20-22, 30-31; 2-7, then 22-26; what is left.
  EXPECT_THAT(machine.ends(), ElementsAre(31000, 26000, 9000));
}

// It may not bring along what it did not use: 1 ms of 2 is left until 10, which is too much at 9.
TEST(CpuModel, WhoWakesUpLateGetsANewBudget) {
  CpuModel model(cpus(1));
  CpuModel::Thread thread;
  thread.policy = Policy::deadline;
  thread.reservation = {.runtime = 2ms, .period = 10ms};
  const auto at = [](Nanoseconds time) { return TimePoint(time); };
  const auto run = [&](Nanoseconds from, Nanoseconds amount) {
    model.wake(thread, at(from));
    EXPECT_TRUE(model.happen(thread, at(from)));
    model.work(thread, amount, at(from));
    return model.next_event(thread) - at(from);
  };
  EXPECT_EQ(run(0ms, 1ms), 1ms);
  EXPECT_TRUE(model.happen(thread, at(1ms)));
  model.sleep(thread, at(1ms));
  EXPECT_EQ(run(9ms, 5ms), 2ms);  // all of a new one
  EXPECT_FALSE(model.happen(thread, at(11ms)));
  EXPECT_EQ(model.next_event(thread), at(19ms));
}

// A deadline before the end of its period: who is late waits for the next one.
TEST(CpuModel, AShortDeadlineIsKept) {
  Machine machine(cpus(1));
  machine.reserve(2ms, 4ms, 10ms, 0ms, 3ms);
  machine.reserve(3ms, 3ms, 10ms, 0ms, 3ms);
  EXPECT_THAT(machine.ends(), ElementsAre(11000, 3000));
}

TEST(CpuModel, RealTimeThreadsLeaveAPartOfEachSecond) {
  CpuModel::Options options = cpus(1);
  options.realtime = 950ms;
  Machine machine(options);
  machine.add(Policy::fifo, 1, 100ms, 1000ms);
  machine.add(Policy::other, 0, 0ms, 120ms);
  machine.add(Policy::fifo, 1, 3100ms, 1000ms);
  // 900 ms until the first second ends, then the rest; the other has 100 ms before and the rest
  // after it. The third has 900 ms of the fourth second, and then 100.
  EXPECT_THAT(machine.ends(), ElementsAre(1100000, 1120000, 4100000));
  Machine hog(options);
  hog.add(Policy::fifo, 1, 0ms, 1000ms);
  hog.add(Policy::other, 0, 0ms, 20ms);
  EXPECT_THAT(hog.ends(), ElementsAre(1050000, 970000));
}

TEST(CpuModel, SpeedsAndChangesCount) {
  CpuModel::Options options = cpus(1);
  options.cpus.front().speed = 0.25;
  options.change = 30us;
  Machine machine(options);
  machine.add(Policy::fifo, 1, 0ms, 3ms);
  machine.add(Policy::fifo, 2, 1ms, 300us);
  // The first one is preempted once, which takes 240 us here.
  EXPECT_THAT(machine.ends(), ElementsAre(13440, 2200));
}

// Else an execution that works in three steps would take longer than its bound.
TEST(CpuModel, WorkInStepsTakesNoLongerThanAtOnce) {
  CpuModel::Options options = cpus(1);
  options.cpus.front().speed = 0.75;
  CpuModel model(options);
  CpuModel::Thread thread;
  thread.policy = Policy::fifo;
  TimePoint now{};
  model.wake(thread, now);
  for (int step = 0; step < 3; ++step) {
    model.work(thread, 1us, now);
    now = model.next_event(thread);
    EXPECT_TRUE(model.happen(thread, now));
  }
  EXPECT_EQ(now.time_since_epoch(), 4us);
}

TEST(CpuModel, WhatCannotBeIsAnError) {
  EXPECT_THROW(CpuModel(cpus(0)), Error);
  CpuModel::Options options = cpus(2);
  options.cpus[1].number = 0;
  EXPECT_THROW(CpuModel{options}, Error);
  options.cpus[1] = {.number = 1, .speed = 0};
  EXPECT_THROW(CpuModel{options}, Error);
}

}  // namespace
}  // namespace takt
