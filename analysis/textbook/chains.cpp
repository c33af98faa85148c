// ROS 2's first executor: Casini, Blaß, Lütkebohle, Brandenburg, "Response-Time Analysis of ROS 2
// Processing Chains Under Reservation-Based Scheduling", ECRTS 2019.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

// Lemmas 3 to 8 have one form: what the last callback of the task has to do until its release, what
// delays it until it begins, and what blocks it.
template <class Interference>
Response from_idle_instant(const TaskSet& set, const Task& task, Time blocking,
                           Interference&& interference) {
  const Supply supply = set.supply();
  const auto last = [&](Time window) { return times(task.last, task.arrivals().most(window)); };
  const auto pending = [&](Time own, Time window) {
    return plus(blocking, plus(last(own), interference(window)));
  };
  return longest_response(
      set, task, [&](Time window) { return pending(window, window); },
      [&](Time offset) {
        return least_fixed_point(
            [&](Time response) {
              const Time window = offset + 1 + std::max(Time{0}, response - task.last);
              return supply.time_for(pending(offset + 1, window), set.limit) - offset;
            },
            set.limit);
      });
}

// What comes before the last callback, and all other tasks.
Result any_order(const TaskSet& set) {
  return for_each_task(set, [&](std::size_t i) {
    const Task& task = set.tasks[i];
    return from_idle_instant(set, task, 0, [&](Time window) {
      Time work = times(task.execution - task.last, task.arrivals().most(window));
      for (std::size_t other = 0; other < set.tasks.size(); ++other) {
        if (other != i) work = plus(work, set.tasks[other].work(window));
      }
      return work;
    });
  });
}

Result event_sources(const TaskSet& set) {
  return for_each_task(set, [&](std::size_t i) {
    return from_idle_instant(set, set.tasks[i], 0, [](Time) { return Time{0}; });
  });
}

// More urgent timers delay a timer; one of the other callbacks blocks it.
Result timers(const TaskSet& set) {
  return for_each_task(set, [&](std::size_t i) {
    const Task& task = set.tasks[i];
    if (!task.is_timer) return Response{.why_not = "no timer: see casini_polling"};
    std::vector<const Task*> urgent;
    Time blocking = 0;
    for (std::size_t other = 0; other < set.tasks.size(); ++other) {
      const Task& found = set.tasks[other];
      if (other == i) continue;
      if (found.is_timer && found.priority >= task.priority) {
        urgent.push_back(&found);
      } else {
        blocking = std::max(blocking, found.execution);
      }
    }
    return from_idle_instant(set, task, set.blocking.value_or(blocking), [&](Time window) {
      Time work = 0;
      for (const Task* other : urgent) work = plus(work, other->work(window));
      return work;
    });
  });
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "wc", "Chains in one work-conserving executor, in any order", any_order,
    .assumes = "one thread; a callback runs to its end; messages of one callback stay in order",
    .source = "Casini, Blaß, Lütkebohle, Brandenburg, ECRTS 2019, Lemma 8; for any order: our own",
    .keys = "wcets T [J] [D]", .settings = "[supply]",
    .example = R"({"supply": {"budget": 3, "period": 5},
 "tasks": [{"wcets": [1, 2, 3], "T": 25}, {"wcets": [1, 1, 1], "T": 20, "J": 25},
           {"wcets": [3], "T": 20, "J": 25}]})",
    .applies_to_takt = true, .takt = "every executor of one thread")

TAKT_REGISTER_TEXTBOOK(
    "casini_timer", "Timers of an executor that serves timers first", timers,
    .assumes = "between two callbacks the executor looks at its timers; the most urgent goes first",
    .source = "Casini, Blaß, Lütkebohle, Brandenburg, ECRTS 2019, Lemma 3",
    .keys = "C T [J] [D] [kind] priority", .settings = "[supply] [B]",
    .example = R"({"supply": {"budget": 3, "period": 5},
 "tasks": [{"C": 1, "T": 10, "priority": 3, "kind": "timer"},
           {"C": 3, "T": 20, "priority": 2, "kind": "timer"},
           {"C": 1, "T": 10, "priority": 1, "kind": "timer"},
           {"C": 4, "T": 50, "priority": 0, "kind": "subscription"}]})",
    .bounds_some = true,
    .takt =
        "here, as in rclcpp since Eloquent, timers wait for the polling point: twice this bound "
        "has been seen")

TAKT_REGISTER_TEXTBOOK(
    "casini_polling", "Subscriptions, services and clients of ROS 2's executor", any_order,
    .assumes = "one thread; they wait for polling points; all other callbacks may go first",
    .source = "Casini, Blaß, Lütkebohle, Brandenburg, ECRTS 2019, Lemmas 4 and 5",
    .keys = "C T [J] [D]", .settings = "[supply]",
    .example = R"({"supply": {"budget": 3, "period": 5},
 "tasks": [{"C": 1, "T": 10}, {"C": 1, "T": 10}, {"C": 3, "T": 20}]})",
    .applies_to_takt = true, .takt = "every executor of one thread, as wc of single callbacks")

TAKT_REGISTER_TEXTBOOK(
    "casini_event_source", "Sources of events that have a thread of their own", event_sources,
    .assumes = "each task has its thread with this supply",
    .source = "Casini, Blaß, Lütkebohle, Brandenburg, ECRTS 2019, Lemma 1", .keys = "C T [J] [D]",
    .settings = "[supply]",
    .example = R"({"supply": {"budget": 3, "period": 5}, "tasks": [{"C": 2, "T": 5, "J": 2}]})",
    .bounds_some = true, .applies_to_takt = true, .takt = "an executor with one callback")

}  // namespace takt::analysis::textbook
