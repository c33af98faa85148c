// Sets of tasks of which theory says what must happen, on a virtual CPU.
// SPDX-License-Identifier: Apache-2.0
#include <tuple>
#include <vector>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

struct Task {
  Nanoseconds work, period;
};

/// The deadlines, which are the periods, that are missed before the end: one callback group for
/// each task, released together.
std::uint64_t misses(const std::vector<Task>& tasks, const std::string& executor_name,
                     ExecutorOptions options, Nanoseconds duration) {
  ManualClock clock(TimePoint{}, {0});
  const auto node = std::make_shared<Node>("tasks", NodeOptions{.clock = &clock});
  std::vector<std::shared_ptr<void>> parts;
  int priority = static_cast<int>(tasks.size());  // rate-monotonic: they are listed by rate
  for (const auto& [work, period] : tasks) {
    const std::string name = "task_" + std::to_string(parts.size());
    const auto group = node->create_callback_group(name, CallbackGroupType::MutuallyExclusive);
    group->set_parameters(
        {.priority = priority--, .deadline = period, .period = period, .budget = work});
    const auto timer = node->create_timer(
        name, period, [&clock, amount = work] { clock.work(amount); }, group);
    timer->release_at(TimePoint(1ms));
    parts.push_back(group);
    parts.push_back(timer);
  }
  options.clock = &clock;
  const auto executor = executors().make(executor_name, options);
  executor->add_node(node);
  {
    const bool is_isolated = executors().traits(executor_name).isolates;
    const ManualSpin spin(*executor, clock, is_isolated ? tasks.size() + 1 : 1);
    clock.advance(1ms + duration);
    executor->release_timers(false);
  }
  std::uint64_t result = 0;
  for (const CallbackStatistics& statistics : executor->statistics()) {
    result += statistics.deadline_misses;
  }
  return result;
}

// Utilisation 1. Rate-monotonic, the third waits for ever longer.
const std::vector<Task> kWithoutPreemption{{2ms, 4ms}, {2ms, 5ms}, {1ms, 10ms}};

TEST(Schedulability, EdfOnOneThreadMissesNothingWhereRateMonotonicPrioritiesDo) {
  const auto two_hyperperiods = 40ms;
  EXPECT_EQ(misses(kWithoutPreemption, "events", {.scheduler = "edf"}, two_hyperperiods), 0u);
  // The third task's first job of each hyperperiod ends after 15 ms.
  EXPECT_EQ(misses(kWithoutPreemption, "events", {.scheduler = "fixed_priority"}, two_hyperperiods),
            2u);
}

// Utilisation 0.97, above what Liu and Layland grant to rate-monotonic priorities: with them the
// second task, of (4, 7), ends after 2 + 4 + 2 = 8.
const std::vector<Task> kWithPreemption{{2ms, 5ms}, {4ms, 7ms}};

ExecutorOptions a_thread_for_each(ThreadPolicy policy) {
  ThreadAttributes thread{.policy = policy};
  if (policy == ThreadPolicy::fifo) thread.priority = 1;
  if (policy == ThreadPolicy::deadline) thread.runtime = thread.period = 1ms;
  return {.threads = {thread}, .per = Isolation::group, .realtime = Realtime::off};
}

TEST(Schedulability, PreemptiveEdfMissesNothingWhereRateMonotonicPrioritiesDo) {
  const auto two_hyperperiods = 70ms;
  EXPECT_EQ(misses(kWithPreemption, "isolated", a_thread_for_each(ThreadPolicy::deadline),
                   two_hyperperiods),
            0u);
  // The second task's first job of each hyperperiod, after 8 ms. Its third ends when the first task
  // is released.
  EXPECT_EQ(
      misses(kWithPreemption, "isolated", a_thread_for_each(ThreadPolicy::fifo), two_hyperperiods),
      2u);
}

// Utilisation 0.85: without preemption 6 ms of work stand in the way of a deadline of 4 ms; with it
// rate-monotonic priorities serve all, for the second ends after 6 + 2 × 1 = 8 at the latest.
const std::vector<Task> kLongWork{{1ms, 4ms}, {6ms, 10ms}};

TEST(Schedulability, APriorityForEachThreadPreemptsWhereOneThreadCannot) {
  const auto two_hyperperiods = 40ms;
  EXPECT_EQ(misses(kLongWork, "isolated", a_thread_for_each(ThreadPolicy::fifo), two_hyperperiods),
            0u);
  // The first task's job that is released at 12 ms waits until 16, in each hyperperiod.
  EXPECT_EQ(misses(kLongWork, "events", {.scheduler = "fixed_priority"}, two_hyperperiods), 2u);
  EXPECT_EQ(misses(kLongWork, "events", {.scheduler = "edf"}, two_hyperperiods), 2u);
}

}  // namespace
}  // namespace takt::conformance
