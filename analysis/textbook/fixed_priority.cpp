// Fixed priorities on one processor.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

bool is_as_urgent(const TaskSet& set, std::size_t other, std::size_t task) {
  return other != task && set.tasks[other].priority >= set.tasks[task].priority;
}

Time urgent_work(const TaskSet& set, std::size_t task, Time window) {
  Time result = 0;
  for (std::size_t other = 0; other < set.tasks.size(); ++other) {
    if (is_as_urgent(set, other, task)) result = plus(result, set.tasks[other].work(window));
  }
  return result;
}

Result preemptive_priorities(const TaskSet& set) {
  const Supply supply = set.supply();
  return for_each_task(set, [&](std::size_t i) {
    const Task& task = set.tasks[i];
    return longest_response(
        set, task,
        [&](Time window) { return plus(task.work(window), urgent_work(set, i, window)); },
        [&](Time offset) {
          const Time end = least_fixed_point(
              [&](Time window) {
                return supply.time_for(plus(task.work(offset + 1), urgent_work(set, i, window)),
                                       set.limit);
              },
              set.limit);
          return end - offset;
        });
  });
}

Time longest_less_urgent(const TaskSet& set, std::size_t task) {
  Time longest = 0;
  for (const Task& other : set.tasks) {
    if (other.priority < set.tasks[task].priority) longest = std::max(longest, other.execution);
  }
  return std::max(Time{0}, longest - 1);
}

Result non_preemptive_priorities(const TaskSet& set) {
  const Supply supply = set.supply();
  return for_each_task(set, [&](std::size_t i) {
    const Task& task = set.tasks[i];
    const Time blocking = set.blocking.value_or(longest_less_urgent(set, i));
    const auto pending = [&](Time own, Time window) {
      return plus(blocking, plus(own, urgent_work(set, i, window)));
    };
    return longest_response(
        set, task, [&](Time window) { return pending(task.work(window), window); },
        [&](Time offset) {
          const Time own = task.work(offset + 1);
          const Time begins = least_fixed_point(
              [&](Time window) {
                return supply.time_for(pending(own, window) - (task.execution - 1), set.limit);
              },
              set.limit);
          if (begins >= kUnbounded) return kUnbounded;
          return supply.time_for(pending(own, begins), set.limit) - offset;
        });
  });
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "fp", "Preemptive fixed priorities", preemptive_priorities,
    .assumes = "independent tasks, preemption anywhere; equal priorities delay each other",
    .source =
        "Joseph, Pandya, 1986; Lehoczky: Fixed Priority Scheduling of Periodic Task Sets with "
        "Arbitrary Deadlines, RTSS 1990",
    .keys = "C T [J] [D] priority", .settings = "[supply]",
    .example =
        R"({"tasks": [{"C": 26, "T": 70, "priority": 2}, {"C": 62, "T": 100, "priority": 1}]})",
    .bounds_some = true, .applies_to_takt = true,
    .takt = "threads of one callback each under SCHED_FIFO on one CPU, of different priorities")

TAKT_REGISTER_TEXTBOOK(
    "np_fp", "Non-preemptive fixed priorities", non_preemptive_priorities,
    .assumes = "independent tasks; equal priorities delay each other",
    .source =
        "Davis, Burns, Bril, Lukkien: Controller Area Network (CAN) schedulability analysis: "
        "Refuted, revisited and revised, 2007",
    .keys = "C T [J] [D] priority", .settings = "[supply] [B]",
    .example = R"({"tasks": [{"C": 20, "T": 70, "priority": 3}, {"C": 20, "T": 80, "priority": 2},
           {"C": 35, "T": 200, "priority": 1}]})",
    .bounds_some = true, .applies_to_takt = true,
    .takt = "executor events, one thread, scheduler fixed_priority, timers only; not wait sets")

}  // namespace takt::analysis::textbook
