// Tasks that may run on any of several processors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

/// The iteration over responses of Bertogna and Cirinei (RTSS 2007): while a task waits, all
/// processors run others; a task that ends early, carries less into a window.
class Iteration {
 public:
  explicit Iteration(const TaskSet& set) : set_(set), slack_(set.tasks.size(), 0) {
    for (const Task& task : set.tasks) {
      if (task.due() <= task.period) continue;
      throw Error(fmt::format("'{}' has a deadline D beyond its period T", task.name),
                  "this analysis needs D ≤ T");
    }
  }

  /// What another task executes in a window, if it keeps its deadline.
  Time work(std::size_t task, Time window) const {
    const Task& of = set_.tasks[task];
    const Time until = window + deadline(task) - slack_[task] - of.execution;
    if (until < 0) return 0;
    const Time whole = until / of.period;
    return plus(times(of.execution, whole),
                std::min(of.execution, until - times(whole, of.period)));
  }
  /// The same in a window that ends with both deadlines, under earliest deadline first.
  Time work_before(std::size_t task, Time window) const {
    const Task& of = set_.tasks[task];
    const Time rest = std::max<Time>(0, window % of.period - slack_[task]);
    return plus(times(of.execution, window / of.period), std::min(of.execution, rest));
  }
  Time deadline(std::size_t task) const { return set_.tasks[task].due(); }
  /// `others`: what the task with this index executes meanwhile at most. Beyond the deadline: none.
  template <class Others>
  Time response(std::size_t task, Others&& others) const {
    const Time own = set_.tasks[task].execution;
    const Time found = least_fixed_point(
        [&](Time window) {
          Time sum = 0;
          for (std::size_t other = 0; other < set_.tasks.size(); ++other) {
            if (other != task) sum = plus(sum, std::min(others(other, window), window - own + 1));
          }
          return plus(own, sum / set_.processors);
        },
        deadline(task), own);
    return found;
  }
  /// It ends so long after its release at most. Returns whether it is better than before.
  bool keeps(std::size_t task, Time response) {
    const Time slack = deadline(task) - response;
    return slack > std::exchange(slack_[task], std::max(slack, slack_[task]));
  }

 private:
  const TaskSet& set_;
  std::vector<Time> slack_;
};

Result global_priorities(const TaskSet& set) {
  Iteration iteration(set);
  std::vector<std::size_t> order(set.tasks.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return set.tasks[a].priority > set.tasks[b].priority;
  });
  Result result{.responses = std::vector<Response>(set.tasks.size())};
  for (std::size_t place = 0; place < order.size(); ++place) {
    const std::size_t task = order[place];
    if (place != 0 && set.tasks[order[place - 1]].priority == set.tasks[task].priority) {
      throw Error("two tasks have the same priority", "this analysis needs different ones");
    }
    const Time found = iteration.response(task, [&](std::size_t other, Time window) {
      return set.tasks[other].priority > set.tasks[task].priority ? iteration.work(other, window)
                                                                  : 0;
    });
    if (found > iteration.deadline(task)) {
      for (; place < order.size(); ++place) {
        result.responses[order[place]].why_not =
            fmt::format("'{}' is not shown to meet its deadline", set.tasks[task].name);
      }
      break;
    }
    iteration.keeps(task, found);
    result.responses[task].bound = found;
  }
  return result;
}

Result global_deadlines(const TaskSet& set) {
  Iteration iteration(set);
  std::vector<Time> found(set.tasks.size());
  for (bool is_better = true; is_better;) {
    is_better = false;
    for (std::size_t task = 0; task < set.tasks.size(); ++task) {
      found[task] = iteration.response(task, [&](std::size_t other, Time window) {
        return std::min(iteration.work(other, window),
                        iteration.work_before(other, iteration.deadline(task)));
      });
      if (found[task] <= iteration.deadline(task)) is_better |= iteration.keeps(task, found[task]);
    }
  }
  // Each rests on the others.
  for (std::size_t task = 0; task < set.tasks.size(); ++task) {
    if (found[task] <= iteration.deadline(task)) continue;
    const std::string late =
        fmt::format("'{}' is not shown to meet its deadline", set.tasks[task].name);
    return for_each_task(set, [&](std::size_t) { return Response{.why_not = late}; });
  }
  return for_each_task(set, [&](std::size_t task) { return Response{.bound = found[task]}; });
}

// Until a job begins, all processors run others.
Result batch(const TaskSet& set) {
  Time all = 0;
  for (const Task& task : set.tasks) all = plus(all, task.execution);
  return for_each_task(set, [&](std::size_t i) {
    const Time own = set.tasks[i].execution;
    return Response{.bound = plus((all - own) / set.processors, own)};
  });
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "g_fp", "Preemptive fixed priorities on several processors", global_priorities,
    .assumes =
        "independent tasks of different priorities, which may run anywhere; D ≤ T, or T "
        "without it",
    .source =
        "Bertogna, Cirinei: Response-Time Analysis for Globally Scheduled Symmetric "
        "Multiprocessor Platforms, RTSS 2007",
    .keys = "C T [D] priority", .settings = "[m]",
    .example =
        R"({"m": 2, "tasks": [{"C": 20, "T": 30, "priority": 3}, {"C": 20, "T": 30, "priority": 2},
           {"C": 5, "T": 30, "priority": 1}]})",
    .bounds_some = true, .applies_to_takt = true,
    .takt = "threads of one callback each under SCHED_FIFO, which may run on the same CPUs")

TAKT_REGISTER_TEXTBOOK(
    "g_edf", "Preemptive earliest deadline first on several processors", global_deadlines,
    .assumes = "independent tasks, which may run anywhere; D ≤ T, or T without it",
    .source =
        "Bertogna, Cirinei: Response-Time Analysis for Globally Scheduled Symmetric "
        "Multiprocessor Platforms, RTSS 2007",
    .keys = "C T [D]", .settings = "[m]",
    .example = R"({"m": 2, "tasks": [{"C": 20, "T": 30}, {"C": 20, "T": 30}, {"C": 5, "T": 30}]})",
    .takt = "reservations have budgets, not the tasks inside them")

TAKT_REGISTER_TEXTBOOK(
    "batch", "Jobs that are there together, on several processors, in any order", batch,
    .assumes = "nothing else runs; no processor is idle while a job waits",
    .source = "Graham: Bounds on Multiprocessing Timing Anomalies, 1969", .keys = "C [D]",
    .settings = "[m]", .example = R"({"m": 2, "tasks": [{"C": 3}, {"C": 2}, {"C": 2}]})",
    .bounds_some = true, .applies_to_takt = true,
    .takt = "a pool with a thread for each CPU, callbacks in groups of their own")

}  // namespace takt::analysis::textbook
