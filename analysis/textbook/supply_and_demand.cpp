// Tables of what a processor supplies, and of what deadlines demand.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

Result supply_bound(const TaskSet& set) {
  const Supply supply = set.supply();
  Result result;
  Time supplied = 0;
  for (Time window = 0; window <= set.until; ++window) {
    // At most one more in each unit of time.
    if (supply.time_for(supplied + 1, set.limit) <= window) ++supplied;
    result.points.emplace_back(window, supplied);
  }
  return result;
}

// Of the executions whose release and deadline lie in a window that begins with a release of all.
Time demand(const TaskSet& set, Time window) {
  Time result = 0;
  for (const Task& task : set.tasks) {
    if (window < *task.deadline) continue;
    result = plus(result, times(task.execution, (window - *task.deadline) / task.period + 1));
  }
  return result;
}

Time no_blocking(const TaskSet&, Time) {
  return 0;
}
// One execution with a later deadline has just begun.
Time later_blocks(const TaskSet& set, Time window) {
  Time result = 0;
  for (const Task& task : set.tasks) {
    if (*task.deadline > window) result = std::max(result, task.execution - 1);
  }
  return result;
}

Result demand_bound(const TaskSet& set, Time (*blocking)(const TaskSet&, Time)) {
  const Time busy = least_fixed_point(
      [&](Time window) {
        Time work = blocking(set, 0);
        for (const Task& task : set.tasks) work = plus(work, task.work(window));
        return work;
      },
      set.limit);
  if (busy >= kUnbounded) {
    throw Error("the busy window is longer than the limit", "give a larger 'limit', or shorten C");
  }
  std::set<Time> deadlines;
  for (const Task& task : set.tasks) {
    for (const Time release : task.steps(busy - *task.deadline + 1)) {
      deadlines.insert(release + *task.deadline);
    }
  }
  Result result{.is_schedulable = true};
  for (const Time deadline : deadlines) {
    const Time wanted = plus(demand(set, deadline), blocking(set, deadline));
    result.points.emplace_back(deadline, wanted);
    if (wanted > deadline) result.is_schedulable = false;
  }
  return result;
}

Result preemptive_demand(const TaskSet& set) {
  return demand_bound(set, no_blocking);
}
Result non_preemptive_demand(const TaskSet& set) {
  return demand_bound(set, later_blocks);
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "sbf", "What a reservation supplies at least in any window", supply_bound,
    .assumes = "the thread is never without work, and the deadline is the period",
    .source =
        "Shin, Lee: Periodic Resource Model for Compositional Real-Time Guarantees, RTSS 2003",
    .settings = "supply until", .example = R"({"supply": {"budget": 3, "period": 5}, "until": 15})",
    .applies_to_takt = true, .takt = "threads under SCHED_DEADLINE whose deadline is the period")

TAKT_REGISTER_TEXTBOOK(
    "dbf", "Whether preemptive earliest deadline first meets all deadlines", preemptive_demand,
    .assumes = "independent tasks, preemption anywhere, one processor",
    .source =
        "Baruah, Rosier, Howell: Algorithms and Complexity Concerning the Preemptive "
        "Scheduling of Periodic Real-Time Tasks on One Processor, 1990",
    .keys = "C T D", .example = R"({"tasks": [{"C": 2, "T": 6, "D": 5}, {"C": 2, "T": 8, "D": 7},
           {"C": 3, "T": 12, "D": 10}]})",
    .takt = "no executor preempts a callback, and Linux runs deadline threads in reservations")

TAKT_REGISTER_TEXTBOOK(
    "np_dbf", "Whether non-preemptive earliest deadline first meets all deadlines",
    non_preemptive_demand, .assumes = "independent tasks, one processor",
    .source =
        "George, Rivierre, Spuri: Preemptive and Non-Preemptive Real-Time Uniprocessor "
        "Scheduling, 1996",
    .keys = "C T D", .example = R"({"tasks": [{"C": 2, "T": 8, "D": 8}, {"C": 3, "T": 12, "D": 12},
           {"C": 4, "T": 16, "D": 16}]})",
    .applies_to_takt = true, .takt = "executor events, one thread, scheduler edf, timers only")

}  // namespace takt::analysis::textbook
