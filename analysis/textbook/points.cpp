// The least point in time first, on a processor of its own: a release and something that each task
// adds to it. Deadlines are such points, and so is the order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

using PointOf = Time (*)(const Task&);

Time deadline_of(const Task& task) {
  return *task.deadline;
}
Time point_of(const Task& task) {
  return task.point;
}

/// Of one task among those of a set.
class ByPoint {
 public:
  ByPoint(const TaskSet& set, std::size_t task, PointOf point, bool is_preemptive)
      : set_(set), own_(set.tasks[task]), point_(point), is_preemptive_(is_preemptive) {
    for (const Task& other : set.tasks) {
      if (&other != &own_) others_.push_back(&other);
    }
  }

  Response response() const {
    const Time busy = busy_window();
    if (busy >= kUnbounded) return {};
    Response result{.bound = 0, .busy_window = busy};
    for (const Time offset : offsets(busy)) {
      result.bound = std::max(result.bound, response(offset));
    }
    if (result.bound > set_.limit) result.bound = kUnbounded;
    return result;
  }

 private:
  Time busy_window() const {
    Time longest = 0;
    for (const Task& task : set_.tasks) longest = std::max(longest, task.execution);
    const Time blocking = is_preemptive_ ? 0 : longest - 1;
    return least_fixed_point(
        [&](Time window) {
          Time work = blocking;
          for (const Task& task : set_.tasks) work = plus(work, task.work(window));
          return work;
        },
        set_.limit);
  }

  // Where the task, or one that is compared with it, is released once more.
  std::vector<Time> offsets(Time busy) const {
    std::vector<Time> result = own_.steps(busy);
    for (const Task* other : others_) {
      const Time shift = point_(*other) - point_(own_);
      for (const Time step : other->steps(busy - shift, -shift)) {
        result.push_back(step + shift);
      }
    }
    return result;
  }

  Time response(Time offset) const {
    const Time own_point = offset + point_(own_);
    Time blocking = 0;
    for (const Task* other : others_) {
      if (point_(*other) > own_point) blocking = std::max(blocking, other->execution - 1);
    }
    const Time rest = is_preemptive_ ? 0 : own_.execution - 1;
    const Time before = plus(is_preemptive_ ? 0 : blocking, own_.work(offset + 1) - rest);
    const Time reached = least_fixed_point(
        [&](Time window) {
          Time work = before;
          for (const Task* other : others_) {
            const Time sooner = std::max(Time{0}, own_point + 1 - point_(*other));
            work = plus(work, other->work(std::min(window, sooner)));
          }
          return work;
        },
        set_.limit);
    return std::max(Time{0}, reached - offset) + rest;
  }

  const TaskSet& set_;
  const Task& own_;
  const PointOf point_;
  const bool is_preemptive_;
  std::vector<const Task*> others_;
};

Result preemptive_deadlines(const TaskSet& set) {
  return for_each_task(
      set, [&](std::size_t i) { return ByPoint(set, i, deadline_of, true).response(); });
}
Result non_preemptive_deadlines(const TaskSet& set) {
  return for_each_task(
      set, [&](std::size_t i) { return ByPoint(set, i, deadline_of, false).response(); });
}
Result non_preemptive_points(const TaskSet& set) {
  return for_each_task(set,
                       [&](std::size_t i) { return ByPoint(set, i, point_of, false).response(); });
}

// All that has arrived no later is done before; one bound for all tasks.
Result order_of_arrival(const TaskSet& set) {
  const auto work = [&](Time window) {
    Time result = 0;
    for (const Task& task : set.tasks) result = plus(result, task.work(window));
    return result;
  };
  Response longest{.bound = 0};
  for (const Task& task : set.tasks) {
    const Response found =
        longest_response(set, task, work, [&](Time offset) { return work(offset + 1) - offset; });
    longest.bound = std::max(longest.bound, found.bound);
    longest.busy_window = found.busy_window;
  }
  return {.responses = std::vector<Response>(set.tasks.size(), longest)};
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "edf", "Preemptive earliest deadline first", preemptive_deadlines,
    .assumes = "independent tasks, preemption anywhere, a processor of its own",
    .source = "Spuri: Analysis of Deadline Scheduled Real-Time Systems, 1996", .keys = "C T [J] D",
    .example = R"({"tasks": [{"C": 79, "T": 120, "D": 50}, {"C": 11, "T": 34, "D": 100},
           {"C": 1, "T": 190, "D": 120}]})",
    .takt = "no executor preempts a callback, and Linux runs deadline threads in reservations")

TAKT_REGISTER_TEXTBOOK(
    "np_edf", "Non-preemptive earliest deadline first", non_preemptive_deadlines,
    .assumes = "independent tasks, a processor of its own",
    .source =
        "George, Rivierre, Spuri: Preemptive and Non-Preemptive Real-Time Uniprocessor "
        "Scheduling, 1996",
    .keys = "C T [J] D",
    .example = R"({"tasks": [{"C": 79, "T": 120, "D": 50}, {"C": 11, "T": 34, "D": 100},
           {"C": 1, "T": 190, "D": 120}]})",
    .applies_to_takt = true, .takt = "executor events, one thread, scheduler edf, timers only")

TAKT_REGISTER_TEXTBOOK(
    "gel", "Non-preemptive, the least release + Y first", non_preemptive_points,
    .assumes = "independent tasks, a processor of its own",
    .source =
        "as np_edf, with any constant Y instead of a deadline (global EDF-like, Erickson, "
        "Anderson, Ward, 2014, on one processor)",
    .keys = "C T [J] [D] Y",
    .example = R"({"tasks": [{"C": 2, "T": 8, "Y": 8}, {"C": 3, "T": 12, "Y": 12},
           {"C": 4, "T": 16, "Y": 16}]})",
    .applies_to_takt = true,
    .takt = "executor events, one thread, schedulers edf and least_laxity, timers only")

TAKT_REGISTER_TEXTBOOK(
    "fifo", "Non-preemptive, in the order of arrival", order_of_arrival,
    .assumes = "independent tasks, a processor of its own",
    .source = "Bedarkar, Vardishvili, Bozhko, Maida, Brandenburg: From Intuition to Coq, RTSS 2022",
    .keys = "C T [J] [D]",
    .example = R"({"tasks": [{"C": 79, "T": 120}, {"C": 11, "T": 34}, {"C": 1, "T": 190}]})",
    .applies_to_takt = true,
    .takt =
        "executor events, one thread, scheduler fifo, timers only: a message overtakes a timer "
        "that is due and has not been looked at")

}  // namespace takt::analysis::textbook
