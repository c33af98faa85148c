// The executor whose callbacks interrupt each other, on a virtual CPU.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "takt/analysis/analysis.hpp"
#include "takt/base/available_cpus.hpp"
#include "takt/executors/conformance/conformance.hpp"
#include "takt/testing/band.hpp"

namespace takt::conformance {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// One execution: which callback, and when it began and ended.
using Job = std::tuple<std::string, Nanoseconds, Nanoseconds>;

class Preemptive : public ::testing::Test {
 protected:
  std::unique_ptr<Executor> make(std::size_t levels, const std::string& scheduler = {}) {
    auto executor =
        executors().make("preemptive", {.scheduler = scheduler,
                                        .threads = band_of(levels),
                                        .realtime = Realtime::off,  // no CPU of this machine
                                        .clock = &clock_});
    executor->add_node(node_);
    return executor;
  }
  std::shared_ptr<CallbackGroup> group(const std::string& name) {
    return node_->create_callback_group(name, CallbackGroupType::MutuallyExclusive);
  }
  void timer(const std::string& name, Nanoseconds first, Nanoseconds period, Nanoseconds work,
             const CallbackParameters& parameters, std::shared_ptr<CallbackGroup> in = nullptr,
             const std::function<void()>& at_end = {}) {
    if (in == nullptr) in = group(name);
    const auto body = [this, name, work, at_end] {
      const Nanoseconds start = clock_.now().time_since_epoch();
      clock_.work(work);
      if (at_end) at_end();
      jobs_.emplace_back(name, start, clock_.now().time_since_epoch());
    };
    timers_.push_back(node_->create_timer(name, period, body, in));
    timers_.back()->set_parameters(parameters);
    timers_.back()->release_at(clock_.now() + first);
  }
  /// What has ended in this time, in the order of the ends, counted from now.
  std::vector<Job> jobs_of(std::size_t levels, Nanoseconds duration,
                           const std::string& scheduler = {}) {
    const TimePoint begin = clock_.now();
    const auto executor = make(levels, scheduler);
    {
      const ManualSpin spin(*executor, clock_, levels);
      clock_.advance(duration);
    }
    std::vector<Job> jobs;
    for (auto [name, start, end] : std::exchange(jobs_, {})) {
      start -= begin.time_since_epoch();
      end -= begin.time_since_epoch();
      if (end <= duration) jobs.emplace_back(name, start, end);
    }
    timers_.clear();
    return jobs;
  }

  ManualClock clock_{TimePoint{}, {available_cpus().front()}};
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<Timer::SharedPtr> timers_;
  std::vector<Job> jobs_;
};

TEST_F(Preemptive, AMoreUrgentCallbackInterruptsAndTheOtherOneGoesOn) {
  timer("low", 0ms, 100ms, 10ms, {.priority = 1});
  timer("high", 3ms, 100ms, 2ms, {.priority = 9});
  timer("middle", 4ms, 100ms, 1ms, {.priority = 5});
  EXPECT_THAT(jobs_of(3, 50ms),
              ElementsAre(Job("high", 3ms, 5ms), Job("middle", 5ms, 6ms), Job("low", 0ms, 13ms)));
}

TEST_F(Preemptive, AsOftenAsTheBandHasPriorities) {
  const auto add = [&] {
    for (int i = 0; i < 4; ++i) {
      timer("t" + std::to_string(i), i * 1ms, 100ms, 10ms, {.priority = i});
    }
  };
  add();
  EXPECT_THAT(jobs_of(4, 60ms), ElementsAre(Job("t3", 3ms, 13ms), Job("t2", 2ms, 22ms),
                                            Job("t1", 1ms, 31ms), Job("t0", 0ms, 40ms)));
  add();  // the third finds no thread above the second, and runs after that
  EXPECT_THAT(jobs_of(2, 60ms), ElementsAre(Job("t1", 1ms, 11ms), Job("t3", 11ms, 21ms),
                                            Job("t2", 21ms, 31ms), Job("t0", 0ms, 40ms)));
}

TEST_F(Preemptive, NoCallbackInterruptsOneOfItsGroup) {
  const auto shared = group("shared");
  timer("low", 0ms, 100ms, 10ms, {.priority = 1}, shared);
  timer("high", 2ms, 100ms, 1ms, {.priority = 9}, shared);
  timer("middle", 1ms, 100ms, 3ms, {.priority = 5});  // it would delay the urgent one, too
  timer("highest", 5ms, 100ms, 1ms, {.priority = 10});
  EXPECT_THAT(jobs_of(4, 50ms), ElementsAre(Job("highest", 5ms, 6ms), Job("low", 0ms, 11ms),
                                            Job("high", 11ms, 12ms), Job("middle", 12ms, 15ms)));
}

TEST_F(Preemptive, AGroupThatHasLostItsMostUrgentCallbackIsInterrupted) {
  const auto shared = group("shared");
  timer("low", 2ms, 100ms, 10ms, {.priority = 1}, shared);
  timer("middle", 3ms, 100ms, 1ms, {.priority = 5});
  timer("high", 50ms, 100ms, 1ms, {.priority = 9}, shared);
  const auto executor = make(3);
  executor->spin_some();
  timers_.pop_back();
  {
    const ManualSpin spin(*executor, clock_, 3);
    clock_.advance(20ms);
  }
  EXPECT_THAT(jobs_, ElementsAre(Job("middle", 3ms, 4ms), Job("low", 2ms, 13ms)));
}

TEST_F(Preemptive, AnEarlierDeadlineInterrupts) {
  timer("long", 0ms, 100ms, 10ms, {.deadline = 20ms});
  timer("late", 1ms, 100ms, 1ms, {.deadline = 30ms});
  timer("soon", 2ms, 100ms, 1ms, {.deadline = 5ms});
  timer("sooner", 16ms, 100ms, 1ms, {.deadline = 5ms});
  EXPECT_THAT(jobs_of(4, 50ms, "edf"),
              ElementsAre(Job("soon", 2ms, 3ms), Job("long", 0ms, 11ms), Job("late", 11ms, 12ms),
                          Job("sooner", 16ms, 17ms)));
}

// A message that a callback sends in its middle.
TEST_F(Preemptive, AMoreUrgentReceiverInterruptsItsSender) {
  const auto receiver = node_->create_subscription<Number>(
      "t", 9,
      [this](const Number&) {
        jobs_.emplace_back("receiver", clock_.now().time_since_epoch(),
                           clock_.now().time_since_epoch());
      },
      group("receiver"));
  receiver->set_parameters({.priority = 9});
  const auto publisher = node_->create_publisher<Number>("t", 9);
  timer("sender", 0ms, 100ms, 2ms, {.priority = 1}, nullptr, [&] {
    publisher->publish(Number{});
    clock_.work(2ms);
  });
  EXPECT_THAT(jobs_of(2, 50ms), ElementsAre(Job("receiver", 2ms, 2ms), Job("sender", 0ms, 4ms)));
}

TEST_F(Preemptive, SaysWhatItNeeds) {
  const auto error = [&](const char* scheduler, std::vector<ThreadAttributes> threads) {
    try {
      executors().make("preemptive",
                       {.name = "e", .scheduler = scheduler, .threads = std::move(threads)});
    } catch (const Error& refused) {
      return std::string(refused.what());
    }
    return std::string();
  };
  EXPECT_EQ(error("edf", band_of(3)), "");
  EXPECT_THAT(error("ros", band_of(2)), HasSubstr("cannot interrupt by the order of 'ros'"));
  EXPECT_THAT(error("ros", band_of(2)), HasSubstr("chain_priority, edf, fixed_priority"));
  auto threads = band_of(2);
  threads[0].priority = 61;
  EXPECT_THAT(error("edf", threads), HasSubstr("not more urgent than the one before it"));
  threads = band_of(2);
  threads[1].affinity.clear();
  EXPECT_THAT(error("edf", threads), HasSubstr("not on one CPU"));
  threads = band_of(2);
  threads[1].policy = ThreadPolicy::other;
  threads[1].priority = 0;
  EXPECT_THAT(error("edf", threads), HasSubstr("not of SCHED_FIFO"));
}

// Under Linux: the less urgent callback waits, for as long as it takes.
TEST(PreemptiveThreads, LetAMoreUrgentCallbackRunInTheMiddleOfAnother) {
  const auto executor = executors().make("preemptive", {.threads = band_of(2)});
  const auto node = std::make_shared<Node>("node");
  const auto in = [&](const char* name) {
    return node->create_callback_group(name, CallbackGroupType::MutuallyExclusive);
  };
  std::atomic<bool> has_run{false}, is_over{false}, has_interrupted{false};
  const auto urgent = node->create_guard_condition(
      "urgent", [&] { has_run = true; }, in("urgent"));
  urgent->set_parameters({.priority = 9});
  const auto usual = node->create_guard_condition(
      "usual",
      [&] {
        urgent->trigger();
        has_interrupted = has_run.load();  // at once, if Linux gives the other thread this CPU
        is_over = true;
      },
      in("usual"));
  executor->add_node(node);
  {
    const SpinThread spin(*executor);
    usual->trigger();
    EXPECT_TRUE(eventually([&] { return is_over.load(); }));
  }
  bool are_realtime = true;
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    are_realtime &= thread.in_force.refused.empty();
  }
  if (!are_realtime) GTEST_SKIP() << "no right to real-time priorities";
  EXPECT_TRUE(has_interrupted.load());
}

// ---- Beside a textbook's scheduler ----

struct RandomTask {
  Nanoseconds first, period, work, deadline;
  int priority;
  std::size_t group;
};

/// Preemptive, by fixed priorities or EDF, with the stack resource policy: written without the
/// executor. Jobs that have not ended are left out.
std::vector<Job> textbook(const std::vector<RandomTask>& tasks, bool is_edf, Nanoseconds end) {
  struct Pending {
    std::size_t task;
    Nanoseconds release, left, start{-1};
  };
  const auto level = [&](std::size_t i) {
    return is_edf ? -tasks[i].deadline.count() : std::int64_t{tasks[i].priority};
  };
  std::vector<std::int64_t> ceilings(tasks.size(), INT64_MIN);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    ceilings[tasks[i].group] = std::max(ceilings[tasks[i].group], level(i));
  }
  const auto is_before = [&](const Pending& a, const Pending& b) {
    if (!is_edf) {
      return std::tuple(-tasks[a.task].priority, a.release) <
             std::tuple(-tasks[b.task].priority, b.release);
    }
    return a.release + tasks[a.task].deadline < b.release + tasks[b.task].deadline;
  };
  std::vector<Nanoseconds> next;
  for (const RandomTask& task : tasks) next.push_back(task.first);
  std::vector<Pending> ready, stack;
  std::vector<Job> jobs;
  Nanoseconds now{0};
  while (now < end) {
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      if (next[i] > now) continue;
      const auto is_its = [&](const Pending& job) { return job.task == i; };
      if (std::any_of(ready.begin(), ready.end(), is_its) ||
          std::any_of(stack.begin(), stack.end(), is_its)) {
        return {};  // overload: not this test's
      }
      ready.push_back({i, next[i], tasks[i].work});
      next[i] += tasks[i].period;
    }
    const auto first = std::min_element(ready.begin(), ready.end(), is_before);
    const bool begins =
        first != ready.end() && std::all_of(stack.begin(), stack.end(), [&](const Pending& job) {
          return level(first->task) > ceilings[tasks[job.task].group] && is_before(*first, job);
        });
    if (begins) {
      first->start = now;
      stack.push_back(*first);
      ready.erase(first);
    }
    const Nanoseconds release = *std::min_element(next.begin(), next.end());
    if (stack.empty()) {
      now = release;
      continue;
    }
    Pending& running = stack.back();
    const Nanoseconds until = std::min(now + running.left, release);
    running.left -= until - now;
    now = until;
    if (running.left > 0ns) continue;
    jobs.emplace_back("t" + std::to_string(running.task), running.start, now);
    stack.pop_back();
  }
  return jobs;
}

/// Whatever the phases: each response is at most its bound.
void expect_below_bounds(const std::vector<RandomTask>& tasks, bool is_edf,
                         const std::vector<Job>& jobs) {
  analysis::System system;
  system.executors.push_back(
      {.name = "e",
       .order = is_edf ? analysis::Order::by_point : analysis::Order::by_urgency,
       .levels = tasks.size()});
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const RandomTask& task = tasks[i];
    system.callbacks.push_back({.name = "t" + std::to_string(i),
                                .execution = task.work.count(),
                                .arrivals = analysis::ArrivalCurve::periodic(task.period.count()),
                                .is_timer = true,
                                .urgency = task.priority,
                                .point = task.deadline.count(),
                                .group = task.group});
  }
  const analysis::Bounds bounds = analysis::analyze(system);
  std::map<std::string, int> count;
  for (const auto& [name, start, end] : jobs) {
    const auto index = static_cast<std::size_t>(std::stoi(name.substr(1)));
    const Nanoseconds release = tasks[index].first + count[name]++ * tasks[index].period;
    EXPECT_EQ(bounds.callbacks[index].method, "preemption");
    EXPECT_LE((end - release).count(), bounds.callbacks[index].bound) << name;
  }
}

class PreemptiveBesideTextbook : public Preemptive,
                                 public ::testing::WithParamInterface<const char*> {};

TEST_P(PreemptiveBesideTextbook, DoesTheSameWithRandomTasks) {
  const int sets = stress_rounds() > 10'000 ? 2000 : 150;
  std::mt19937_64 random(7);
  const auto between = [&](std::int64_t least, std::int64_t most) {
    return std::uniform_int_distribution<std::int64_t>(least, most)(random);
  };
  const Nanoseconds end = 400ms;
  int compared = 0, interrupted = 0;
  for (int set = 0; set < sets; ++set) {
    const auto count = static_cast<std::size_t>(between(2, 7));
    std::vector<RandomTask> tasks(count);
    for (std::size_t i = 0; i < count; ++i) {
      RandomTask& task = tasks[i];
      task.period = Nanoseconds(between(5'000'000, 60'000'000));
      task.first = Nanoseconds(between(1, 20'000'000));
      task.work = task.period * between(30, 900) / static_cast<int>(1000 * count) + 1ns;
      task.deadline = Nanoseconds(between(task.period.count() / 2, task.period.count()));
      task.priority = static_cast<int>(i);
      task.group = static_cast<std::size_t>(between(0, static_cast<std::int64_t>(count) - 1));
    }
    const bool is_edf = GetParam() == std::string("edf");
    std::vector<Job> expected = textbook(tasks, is_edf, end);
    if (expected.empty()) continue;
    node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
    std::map<std::size_t, std::shared_ptr<CallbackGroup>> groups;
    for (std::size_t i = 0; i < count; ++i) {
      auto& its = groups[tasks[i].group];
      if (its == nullptr) its = group("g" + std::to_string(tasks[i].group));
      timer("t" + std::to_string(i), tasks[i].first, tasks[i].period, tasks[i].work,
            {.priority = tasks[i].priority, .deadline = tasks[i].deadline}, its);
    }
    std::erase_if(expected, [&](const Job& job) { return std::get<2>(job) > end; });
    const std::vector<Job> seen = jobs_of(count, end, GetParam());
    const auto [here, there] =
        std::mismatch(seen.begin(), seen.end(), expected.begin(), expected.end());
    ASSERT_TRUE(here == seen.end() && there == expected.end())
        << "set " << set << ", after " << here - seen.begin() << " of " << expected.size() << ": "
        << ::testing::PrintToString(std::vector<Job>(here, std::min(here + 3, seen.end())))
        << " instead of "
        << ::testing::PrintToString(std::vector<Job>(there, std::min(there + 3, expected.end())));
    expect_below_bounds(tasks, is_edf, expected);
    ++compared;
    for (std::size_t i = 1; i < seen.size(); ++i) {
      interrupted += std::get<1>(seen[i]) < std::get<1>(seen[i - 1]) ? 1 : 0;
    }
  }
  EXPECT_GT(compared, sets / 2);
  EXPECT_GT(interrupted, compared);
}

INSTANTIATE_TEST_SUITE_P(Orders, PreemptiveBesideTextbook,
                         ::testing::Values("fixed_priority", "edf"),
                         [](const auto& order) { return std::string(order.param); });

}  // namespace
}  // namespace takt::conformance
