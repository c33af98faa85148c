// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <random>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/analysis/textbook/textbook.hpp"
#include "takt/base/error.hpp"

namespace takt::analysis::textbook {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<Time> responses(const std::string& name, const TaskSet& set) {
  std::vector<Time> result;
  for (const Response& response : analyse(name, set).responses) result.push_back(response.bound);
  return result;
}

/// A job: [first, last] of its release, [shortest, longest], the deadline from the first; the
/// least rank goes first.
Task job(Time first, Time last, Time shortest, Time longest, Time deadline, std::int64_t rank) {
  return {.name = "job",
          .execution = longest,
          .shortest = shortest,
          .offset = first,
          .jitter = last - first,
          .deadline = deadline,
          .priority = -rank};
}

/// From its earliest release on.
std::vector<Time> ends(const std::vector<Task>& jobs, Count processors = 1) {
  std::vector<Time> result = responses("sag_fp", {.tasks = jobs, .processors = processors});
  for (std::size_t i = 0; i < jobs.size(); ++i) result[i] += jobs[i].offset;
  return result;
}

// The jobs of figure 1 of Nasri and Brandenburg, "An Exact and Sustainable Analysis of Non-
// Preemptive Scheduling" (RTSS 2017), where the second task's second job takes 7.
TEST(ScheduleGraph, FindsWhatTheFirstFigureShows) {
  TaskSet set{.tasks = {{.name = "short", .execution = 2, .shortest = 1, .period = 10},
                        {.name = "middle", .execution = 8, .shortest = 7, .period = 30},
                        {.name = "long", .execution = 13, .shortest = 3, .period = 60}}};
  const Result on_one = analyse("sag_edf", set);
  for (const Response& response : on_one.responses) {
    EXPECT_THAT(response.why_not, HasSubstr("'short' may be late"));
  }
  set.processors = 2;
  const std::vector<Time> found = responses("sag_edf", set);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_LE(found[i], set.tasks[i].period);
}

// Figure 1 of the paper of ECRTS 2018: the fifth job may miss its deadline, though it is short.
TEST(ScheduleGraph, FindsTheMissOnTwoProcessors) {
  const std::vector<Task> jobs{job(0, 0, 2, 4, 7, 1), job(0, 0, 10, 15, 20, 2),
                               job(5, 5, 1, 7, 10, 3), job(8, 8, 2, 3, 12, 4),
                               job(8, 8, 1, 1, 6, 5)};
  const std::vector<Time> latest = ends(jobs, 2);
  EXPECT_EQ(latest[0], 4);
  EXPECT_EQ(latest[1], 15);
  EXPECT_EQ(latest[2], 12);
  EXPECT_GT(latest[4], 14);
}

// The latest ends of jobs as the authors' tool has them in its tests.
TEST(ScheduleGraph, AgreesWithTheAuthorsTool) {
  EXPECT_THAT(ends({job(0, 0, 3, 8, 100, 1), job(7, 7, 5, 5, 100, 2), job(10, 10, 1, 11, 100, 3)}),
              ElementsAre(8, 13, 24));
  EXPECT_THAT(ends({job(0, 0, 3, 10, 100, 3), job(7, 7, 5, 5, 100, 2), job(10, 10, 5, 5, 100, 1)}),
              ElementsAre(10, 20, 19));
  EXPECT_THAT(ends({job(0, 0, 3, 10, 100, 2), job(0, 0, 5, 5, 100, 1)}), ElementsAre(15, 5));
  EXPECT_THAT(ends({job(0, 1, 3, 10, 100, 2), job(0, 1, 5, 5, 100, 1)}), ElementsAre(16, 15));
  EXPECT_THAT(ends({job(0, 0, 1, 5, 100, 2), job(0, 0, 1, 20, 100, 3), job(10, 10, 5, 5, 100, 1)}),
              ElementsAre(5, 25, 30));
  EXPECT_THAT(ends({job(0, 10, 2, 50, 2000, 1), job(0, 10, 50, 1200, 5000, 2),
                    job(1000, 1010, 2, 50, 3000, 1)}),
              ElementsAre(1259, 1260, 1310));
}

TEST(ScheduleGraph, RefusesWhatItDoesNotCover) {
  const Task task{.name = "task", .execution = 1, .period = 10, .priority = 1};
  const auto refuses = [](Task changed) {
    EXPECT_THROW(analyse("sag_fp", {.tasks = {std::move(changed)}}), Error);
  };
  Task late = task, far = task, many = task, endless = task;
  late.offset = 1;
  refuses(late);
  far.deadline = 11;
  refuses(far);
  many.period = 100'003;
  EXPECT_THROW(analyse("sag_fp", {.tasks = {many, task}}), Error);
  endless.period = kUnbounded - 1;
  EXPECT_THROW(analyse("sag_fp", {.tasks = {endless, many}}), Error);
  EXPECT_THROW(analyse("sag_edf", {.tasks = {{.name = "job", .execution = 1}}}), Error);
  // A job that comes after the tasks have repeated met none of them.
  EXPECT_THROW(analyse("sag_fp", {.tasks = {task, job(1000, 1000, 3, 3, 100, 1)}}), Error);
  EXPECT_THROW(analyse("sag_fp", {.tasks = {job(9, 9, 99, 99, 200, 1), task}}), Error);
}

// By hand: of the third, 20 of both others count, so 5 + 40 / 2; of the first, 5 of the third and 6
// of the second, so 20 + 11 / 2.
TEST(SeveralProcessors, ByHand) {
  const TaskSet set{.tasks = {{.name = "a", .execution = 20, .period = 30, .priority = 3},
                              {.name = "b", .execution = 20, .period = 30, .priority = 2},
                              {.name = "c", .execution = 5, .period = 30, .priority = 1}},
                    .processors = 2};
  EXPECT_THAT(responses("g_fp", set), ElementsAre(20, 20, 25));
  EXPECT_THAT(responses("g_edf", set), ElementsAre(25, 25, 25));
  EXPECT_THAT(responses("batch", set), ElementsAre(32, 32, 25));
}

// ---- Against simulations ----

struct Released {
  std::size_t task;
  Time begin, release, cost;
  std::int64_t rank;
  Time left = cost;
  bool is_running = false;
};

/// The longest times from the begins of periods to the ends, time unit by time unit.
std::vector<Time> simulate(std::vector<Released> jobs, std::size_t tasks, Count processors,
                           bool preempts) {
  std::vector<Time> longest(tasks, 0);
  for (Time now = 0; !jobs.empty(); ++now) {
    std::stable_sort(jobs.begin(), jobs.end(), [&](const Released& a, const Released& b) {
      const auto key = [&](const Released& job) {
        return std::tuple(job.release > now, !preempts && !job.is_running, job.rank, job.begin,
                          job.task);
      };
      return key(a) < key(b);
    });
    const std::size_t most = std::min(jobs.size(), static_cast<std::size_t>(processors));
    for (std::size_t i = 0; i < most && jobs[i].release <= now; ++i) {
      jobs[i].is_running = true;
      if (--jobs[i].left == 0) {
        longest[jobs[i].task] = std::max(longest[jobs[i].task], now + 1 - jobs[i].begin);
      }
    }
    std::erase_if(jobs, [](const Released& job) { return job.left == 0; });
  }
  return longest;
}

class Random {
 public:
  explicit Random(int seed) : random_(seed) {}
  Time between(Time first, Time last) {
    return std::uniform_int_distribution<Time>(first, last)(random_);
  }
  /// Its tasks have different priorities.
  TaskSet set() {
    TaskSet set{.processors = between(1, 3)};
    for (Time left = between(2, 6); left > 0; --left) {
      const Time period = std::array{4, 6, 8, 12, 24}[between(0, 4)];
      const Time longest = between(1, period / 2), jitter = between(0, 2);
      set.tasks.push_back({.name = std::to_string(left),
                           .execution = longest,
                           .last = longest,
                           .shortest = between(1, longest),
                           .period = period,
                           .jitter = jitter,
                           .deadline = period,
                           .priority = left});
    }
    return set;
  }
  std::vector<Released> jobs(const TaskSet& set, Time until, bool by_deadline) {
    std::vector<Released> result;
    for (std::size_t i = 0; i < set.tasks.size(); ++i) {
      const Task& task = set.tasks[i];
      for (Time begin = 0; begin < until; begin += task.period) {
        const Time cost = between(task.shortest, task.execution);
        result.push_back({i, begin, begin + between(0, task.jitter), cost,
                          by_deadline ? begin + *task.deadline : -task.priority, cost});
      }
    }
    return result;
  }

 private:
  std::mt19937_64 random_;
};

TEST(SeveralProcessors, NothingSimulatedIsAboveABound) {
  Random random(1);
  std::size_t bounded = 0;
  for (int round = 0; round < 200; ++round) {
    TaskSet set = random.set();
    const auto compare = [&](const char* name, bool by_deadline, bool preempts) {
      std::vector<Time> found;
      try {
        found = responses(name, set);
      } catch (const Error&) {
        return;  // more work than time
      }
      for (int run = 0; run < 10; ++run) {
        const auto seen =
            simulate(random.jobs(set, 48, by_deadline), set.tasks.size(), set.processors, preempts);
        for (std::size_t i = 0; i < found.size(); ++i) {
          EXPECT_LE(seen[i], found[i]) << name << ", task " << i << " of round " << round;
          bounded += found[i] < kUnbounded ? 1 : 0;
        }
      }
    };
    compare("sag_fp", false, false);
    compare("sag_edf", true, false);
    for (Task& task : set.tasks) task.jitter = 0;
    compare("g_fp", false, true);
    compare("g_edf", true, true);
  }
  EXPECT_GT(bounded, 5000U);
}

}  // namespace
}  // namespace takt::analysis::textbook
