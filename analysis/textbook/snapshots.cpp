// ROS 2's executor with polling points, where each callback is served once between two of them:
// Blaß, Casini, Bozhko, Brandenburg, "A ROS 2 Response-Time Analysis Exploiting Starvation Freedom
// and Execution-Time Variance", RTSS 2021. For single callbacks.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/analysis/textbook/textbook.hpp"
#include "takt/base/error.hpp"

namespace takt::analysis::textbook {
namespace {

// How many more of a callback than polling points may go first.
Count one_before(const Task& other, const Task& task) {
  if (task.is_timer || !other.place || !task.place) return 1;
  return *other.place < *task.place ? 1 : 0;
}

// All that goes before, and one unit of the execution: what is then left of it is not delayed.
Time end_of(const TaskSet& set, const Task& task, Time begins) {
  if (begins >= kUnbounded) return kUnbounded;
  return set.supply().time_for(begins - 1 + task.execution, set.limit);
}

// Theorem 2, with the response times that were found so far.
Time starvation_free(const TaskSet& set, std::size_t i, const std::vector<Time>& responses) {
  const Task& task = set.tasks[i];
  const Supply supply = set.supply();
  const Count polls = task.arrivals().most(responses[i]);
  const auto before = [&](Time window) {
    Time work = 1;
    for (std::size_t j = 0; j < set.tasks.size(); ++j) {
      const Task& other = set.tasks[j];
      Count runs = other.arrivals().most(window + responses[j] - 1);
      if (j == i) {
        --runs;
      } else if (!other.is_timer) {
        runs = std::min(runs, polls + one_before(other, task));
      }
      work = plus(work, times(other.execution, runs));
    }
    return work;
  };
  const Time begins = least_fixed_point(
      [&](Time window) { return supply.time_for(before(window), set.limit); }, set.limit);
  return end_of(set, task, begins < kUnbounded ? before(begins) : kUnbounded);
}

/// Theorem 3: of releases in a busy window.
class InBusyWindow {
 public:
  InBusyWindow(const TaskSet& set, std::size_t task, const std::vector<Time>& responses)
      : set_(set),
        own_(set.tasks[task]),
        polls_(own_.arrivals().most(responses[task])),
        supply_(set.supply()) {}

  Time response() const {
    const Time busy = least_fixed_point(
        [&](Time window) {
          const Time own = times(own_.execution, own_.arrivals().most(window));
          return supply_.time_for(plus(1 + own, interference(window, window)), set_.limit);
        },
        set_.limit);
    if (busy >= kUnbounded) return kUnbounded;
    Time longest = 0;
    for (const Time offset : offsets(busy)) longest = std::max(longest, response(offset));
    return longest;
  }

 private:
  Time interference(Time window, Time offset) const {
    Time work = 0;
    for (const Task& other : set_.tasks) {
      if (&other == &own_) continue;
      Count runs = other.arrivals().most(window);
      if (!other.is_timer) {
        runs = std::min(runs, other.arrivals().most(offset) + polls_ + one_before(other, own_));
      }
      work = plus(work, times(other.execution, runs));
    }
    return work;
  }
  // Where the callback is released once more, or another one has just been.
  std::vector<Time> offsets(Time busy) const {
    std::vector<Time> result = own_.steps(busy);
    for (const Task& other : set_.tasks) {
      if (&other == &own_ || other.is_timer) continue;
      for (const Time step : other.steps(busy - 1)) result.push_back(step + 1);
    }
    return result;
  }
  Time response(Time offset) const {
    const Time earlier = times(own_.execution, own_.arrivals().most(offset + 1) - 1);
    const auto before = [&](Time window) {
      return plus(1 + earlier, interference(window, offset));
    };
    const Time begins = least_fixed_point(
        [&](Time window) { return supply_.time_for(before(window), set_.limit); }, set_.limit);
    if (begins >= kUnbounded) return kUnbounded;
    return std::max(Time{0}, end_of(set_, own_, before(begins)) - offset);
  }

  const TaskSet& set_;
  const Task& own_;
  const Count polls_;
  const Supply supply_;
};

constexpr int kMostRounds = 1000;

// The response times depend on each other: from the executions upwards until nothing changes.
template <class ResponseOf>
Result common_fixed_point(const TaskSet& set, ResponseOf&& response_of) {
  std::vector<Time> responses;
  for (const Task& task : set.tasks) responses.push_back(task.execution);
  bool has_changed = true;
  for (int round = 0; has_changed; ++round) {
    if (round == kMostRounds) {  // in steps of an execution, up to a limit that is far away
      throw Error(fmt::format("the response times still grow after {} rounds", kMostRounds),
                  "give a smaller limit, shorter executions or longer periods");
    }
    has_changed = false;
    std::vector<Time> next;
    for (std::size_t i = 0; i < responses.size(); ++i) {
      next.push_back(std::max(responses[i], response_of(i, responses)));
      // The others depend on it.
      if (next[i] > set.limit) return {.responses = std::vector<Response>(responses.size())};
    }
    has_changed = next != responses;
    responses = std::move(next);
  }
  return for_each_task(set, [&](std::size_t i) { return Response{.bound = responses[i]}; });
}

Result round_robin(const TaskSet& set) {
  return common_fixed_point(set, [&](std::size_t i, const std::vector<Time>& responses) {
    return starvation_free(set, i, responses);
  });
}
Result busy_window(const TaskSet& set) {
  return common_fixed_point(set, [&](std::size_t i, const std::vector<Time>& responses) {
    return InBusyWindow(set, i, responses).response();
  });
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "blass_rr", "Single callbacks of ROS 2's executor, by polling points", round_robin,
    .assumes = "one thread; between two polling points each subscription runs once at most",
    .source = "Blaß, Casini, Bozhko, Brandenburg, RTSS 2021, Theorem 2",
    .keys = "C T [J] [D] [kind] [order]", .settings = "[supply]",
    .example = R"({"tasks": [{"C": 10, "T": 100}, {"C": 230, "T": 10000}, {"C": 190, "T": 1000}]})",
    .applies_to_takt = true,
    .takt =
        "executor single_threaded, if timers are given as subscriptions: here they wait for "
        "polling points, too")

TAKT_REGISTER_TEXTBOOK(
    "blass_bw", "Single callbacks of ROS 2's executor, by polling points in a busy window",
    busy_window,
    .assumes = "one thread; between two polling points each subscription runs once at most",
    .source = "Blaß, Casini, Bozhko, Brandenburg, RTSS 2021, Theorem 3",
    .keys = "C T [J] [D] [kind] [order]", .settings = "[supply]",
    .example = R"({"tasks": [{"C": 10, "T": 100}, {"C": 230, "T": 10000}, {"C": 190, "T": 1000}]})",
    .applies_to_takt = true,
    .takt =
        "executor single_threaded, if timers are given as subscriptions: here they wait for "
        "polling points, too")

}  // namespace takt::analysis::textbook
