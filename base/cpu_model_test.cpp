// Tests of virtual CPUs, with threads that do nothing but work.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/cpu_model.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using Policy = CpuModel::Policy;
using ::testing::ElementsAre;

/// Threads with some work each, perhaps again after a pause; runs them all.
class Machine {
 public:
  struct Job {
    CpuModel::Thread thread;
    Nanoseconds begin{0}, amount{0};
    std::int64_t times = 1;
    Nanoseconds pause{0}, left{0};
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
  /// The last one that was added.
  void repeat(std::int64_t times, Nanoseconds pause) {
    jobs_.back().times = times;
    jobs_.back().pause = pause;
  }
  void record(std::vector<CpuModel::Change>& changes) { model_.record(changes); }
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
      first->left = first->amount;
      model_.wake(first->thread, time);
    } else if (model_.happen(first->thread, time)) {
      if (first->left != 0ms) {
        model_.work(first->thread, std::exchange(first->left, 0ms), time);
      } else {
        first->state = --first->times != 0 ? Job::State::before : Job::State::done;
        first->begin = later(time, first->pause).time_since_epoch();
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

// ---- Beside what the header says, in steps of a millisecond ----

/// In milliseconds.
struct Demand {
  Policy policy{};
  int priority = 0;
  std::int64_t begin = 0, amount = 0, pause = 0, times = 1, runtime = 0, period = 0;
};

class DrawnDemands {
 public:
  explicit DrawnDemands(std::uint64_t seed) : random_(seed) {}
  std::int64_t between(std::int64_t least, std::int64_t most) {
    return least +
           static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(most - least + 1));
  }
  /// Of threads that a CPU can have: reservations are at most all of it.
  std::vector<Demand> draw() {
    std::vector<Demand> demands;
    std::int64_t percent_left = 100;
    bool has_other = false;
    for (std::int64_t count = between(1, 5); count > 0; --count) {
      Demand demand{.begin = between(0, 300),
                    .amount = between(1, 700),
                    .pause = between(1, 400),
                    .times = between(1, 3)};
      const std::int64_t kind = between(0, 7);
      demand.policy = kind < 2 ? Policy::deadline : kind < 4 ? Policy::fifo : Policy::rr;
      if (kind == 7 && !std::exchange(has_other, true)) demand.policy = Policy::other;
      if (demand.policy == Policy::deadline) {
        demand.period = between(10, 100);
        demand.runtime = std::max<std::int64_t>(1, demand.period * between(5, 50) / 100);
        percent_left -= (100 * demand.runtime + demand.period - 1) / demand.period;
        if (percent_left < 0) break;
      } else if (demand.policy != Policy::other) {
        demand.priority = static_cast<int>(between(1, 2));
      }
      demands.push_back(demand);
    }
    return demands;
  }

 private:
  std::mt19937_64 random_;
};

void add(const Demand& demand, Machine& machine) {
  const auto ms = [](std::int64_t time) { return std::chrono::milliseconds(time); };
  machine.add(demand.policy, demand.priority, ms(demand.begin), ms(demand.amount)).reservation = {
      .runtime = ms(demand.runtime), .period = ms(demand.period)};
  machine.repeat(demand.times, ms(demand.pause));
}

/// One CPU, on which each millisecond belongs to one thread.
class InSteps {
 public:
  explicit InSteps(const std::vector<Demand>& demands) {
    for (const Demand& demand : demands) threads_.push_back({demand});
  }

  /// As Machine::ends.
  std::vector<std::int64_t> ends() {
    const auto is_over = [](const Thread& thread) { return thread.of.times == 0; };
    for (std::int64_t now = 0; !std::all_of(threads_.begin(), threads_.end(), is_over); ++now) {
      for (Thread& thread : threads_) look_at(thread, now);
      end_what_runs(now);
      if (now % 1000 == 0) used_ = 0;
      is_throttled_ = used_ == 950;
      Thread* const ran = end_what_runs(now);
      if (ran == nullptr) continue;
      --ran->left;
      --ran->budget;
      --ran->slice;
      if (ran->of.policy == Policy::fifo || ran->of.policy == Policy::rr) ++used_;
    }
    std::vector<std::int64_t> result;
    for (const Thread& thread : threads_) result.push_back(thread.end * 1000);
    return result;
  }

 private:
  struct Thread {
    Demand of;
    bool is_awake = false, is_throttled = false;
    std::int64_t left = 0, budget = 0, due = -1, slice = 100, place = 0, end = 0;
  };

  // One after the other, as they were made: one that ends just when another one preempts it ends
  // when it has the CPU again.
  void look_at(Thread& thread, std::int64_t now) {
    const Demand& of = thread.of;
    if (!thread.is_awake && of.times != 0 && of.begin == now) wake(thread, now);
    if (thread.is_awake && has_come_to_an_end(thread) && next() == &thread) end(thread, now);
    if (!thread.is_awake || !thread.is_throttled || now < thread.due) return;
    thread.is_throttled = false;
    thread.budget = of.runtime;
    thread.due += of.period;
  }

  /// The one that runs then.
  Thread* end_what_runs(std::int64_t now) {
    Thread* first = next();
    for (; first != nullptr && has_come_to_an_end(*first); first = next()) end(*first, now);
    return first;
  }

  static bool has_come_to_an_end(const Thread& thread) {
    const Policy policy = thread.of.policy;
    return thread.left == 0 || (policy == Policy::rr && thread.slice == 0) ||
           (policy == Policy::deadline && thread.budget == 0);
  }
  void end(Thread& thread, std::int64_t now) {
    if (thread.left == 0) {
      thread.is_awake = false;
      thread.end = now;
      thread.of.begin = now + thread.of.pause;
      --thread.of.times;
    } else if (thread.of.policy == Policy::deadline) {
      thread.is_throttled = true;
    } else {
      thread.place = ++places_;
      thread.slice = 100;
    }
  }

  void wake(Thread& thread, std::int64_t now) {
    const Demand& of = thread.of;
    thread.is_awake = true;
    thread.is_throttled = false;
    thread.left = of.amount;
    thread.place = ++places_;
    if (thread.slice == 0) thread.slice = 100;
    if (of.policy != Policy::deadline) return;
    if (now < thread.due && thread.budget * of.period <= (thread.due - now) * of.runtime) {
      thread.is_throttled = thread.budget == 0;
      return;
    }
    thread.budget = of.runtime;
    thread.due = now + of.period;
  }

  Thread* next() {
    Thread* first = nullptr;
    const auto key = [](const Thread& thread) {
      const Policy policy = thread.of.policy;
      const int rank = policy == Policy::deadline ? 0 : policy == Policy::other ? 2 : 1;
      const std::int64_t order = rank == 0 ? thread.due : -thread.of.priority;
      return std::tuple(rank, order, thread.place);
    };
    for (Thread& thread : threads_) {
      const bool is_of_realtime =
          thread.of.policy == Policy::fifo || thread.of.policy == Policy::rr;
      if (!thread.is_awake || thread.is_throttled || (is_of_realtime && is_throttled_)) continue;
      if (first == nullptr || key(thread) < key(*first)) first = &thread;
    }
    return first;
  }

  std::vector<Thread> threads_;
  std::int64_t used_ = 0, places_ = 0;
  bool is_throttled_ = false;
};

TEST(CpuModel, DoesInEventsWhatTheWordsSayInSteps) {
  std::size_t late = 0;
  constexpr std::uint64_t kMachines = 2000 / kFewerSanitized;
  for (std::uint64_t seed = 1; seed <= kMachines; ++seed) {
    const std::vector<Demand> demands = DrawnDemands(seed).draw();
    CpuModel::Options options = cpus(1);
    options.realtime = 950ms;
    Machine machine(options);
    for (const Demand& demand : demands) add(demand, machine);
    const std::vector<std::int64_t> ends = machine.ends();
    ASSERT_EQ(ends, InSteps(demands).ends()) << seed;
    late += !ends.empty() && *std::max_element(ends.begin(), ends.end()) > 1'000'000 ? 1 : 0;
  }
  EXPECT_GT(late, kMachines / 4);  // where throttling and new budgets come in
}

// Of Shin and Lee, "Periodic resource model for compositional real-time guarantees", 2003; and no
// more than two budgets beside those of whole periods.
TEST(CpuModel, AReservationHasItsSupplyInEachWindow) {
  std::size_t windows = 0;
  for (std::uint64_t seed = 1; seed <= 300 / kFewerSanitized; ++seed) {
    DrawnDemands draws(seed);
    std::vector<Demand> demands = draws.draw();
    std::erase_if(demands, [](const Demand& of) { return of.policy == Policy::deadline; });
    Machine machine(cpus(1));
    const Nanoseconds period = std::chrono::milliseconds(draws.between(10, 60));
    const Nanoseconds budget = period * draws.between(10, 60) / 100;
    const CpuModel::Thread& hog =
        machine.reserve(budget, 0ms, period, std::chrono::milliseconds(draws.between(0, 50)), 1s);
    const std::int64_t rest = draws.between(1, 40);  // of the CPU, for another one
    machine.reserve(Nanoseconds(20ms) * rest / 100, 0ms, 20ms, 0ms, 500ms);
    machine.repeat(3, 7ms);
    for (const Demand& demand : demands) add(demand, machine);
    std::vector<CpuModel::Change> changes;
    machine.record(changes);
    static_cast<void>(machine.ends());
    std::vector<std::pair<TimePoint, TimePoint>> pieces;  // in which it ran
    for (const CpuModel::Change& change : changes) {
      if (change.before == &hog) pieces.back().second = change.time;
      if (change.after == &hog) pieces.emplace_back(change.time, change.time);
    }
    const auto least = [&](Nanoseconds window) {
      const Nanoseconds gap = period - budget;
      if (window < gap) return Nanoseconds(0);
      const std::int64_t whole = (window - gap) / period;
      return whole * budget + std::max(Nanoseconds(0), window - 2 * gap - whole * period);
    };
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      Nanoseconds supplied{0};  // between the pieces i and k, and with both
      for (std::size_t k = i + 1; k < pieces.size(); ++k) {
        ASSERT_GE(supplied, least(pieces[k].first - pieces[i].second)) << seed;
        supplied += pieces[k].second - pieces[k].first;
        const Nanoseconds window = pieces[k].second - pieces[i].first;
        ASSERT_LE(supplied + (pieces[i].second - pieces[i].first), (window / period + 2) * budget)
            << seed;
        ++windows;
      }
    }
  }
  EXPECT_GT(windows, 100'000u / kFewerSanitized);
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
