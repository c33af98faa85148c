// Choi, Xiang, Kim: "PiCAS: New Design of Priority-Driven Chain-Aware Scheduling for ROS2", RTAS
// 2021, as its authors' model computes it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

class Picas {
 public:
  explicit Picas(const TaskSet& set) : set_(set) {}

  // The sum over the CPUs that the chain visits; if that is longer than its period, the instance
  // before may still run.
  Response response(const Task& chain) const {
    std::map<int, std::vector<const Task::Part*>> segments;
    for (const Task::Part& part : chain.parts) segments[cpu(part)].push_back(&part);
    Time sum = 0;
    for (const auto& [cpu, parts] : segments) {
      const double wanted = wanted_from(least_urgent(parts));
      if (wanted > 1 + 1e-9) {
        return {.why_not = fmt::format(
                    "its callbacks and the more urgent ones need {:.3f} of CPU {}", wanted, cpu)};
      }
      sum = plus(sum, of_segment(chain, parts));
    }
    if (sum > chain.period) sum = plus(sum, chain.period);
    return {.bound = sum > set_.limit ? kUnbounded : sum};
  }

 private:
  int cpu(const Task::Part& part) const { return set_.executors[part.executor].cpu; }
  /// The order of a CPU's callbacks: threads first.
  std::pair<std::int64_t, std::int64_t> urgency(const Task::Part& part) const {
    return {set_.executors[part.executor].priority, part.priority};
  }
  bool is_on_one_cpu(const Task& chain) const {
    return std::all_of(chain.parts.begin(), chain.parts.end(), [&](const Task::Part& part) {
      return cpu(part) == cpu(chain.parts.front());
    });
  }

  const Task::Part& least_urgent(const std::vector<const Task::Part*>& segment) const {
    return **std::min_element(segment.begin(), segment.end(), [&](const auto* a, const auto* b) {
      return urgency(*a) < urgency(*b);
    });
  }

  // Of its CPU, by the callback and all that are as urgent. Above 1 they fall behind for ever,
  // which the formula does not see.
  double wanted_from(const Task::Part& least) const {
    double wanted = 0;
    for (const Task& task : set_.tasks) {
      for (const Task::Part& part : task.parts) {
        if (cpu(part) != cpu(least) || urgency(part) < urgency(least)) continue;
        wanted += static_cast<double>(part.execution) / static_cast<double>(task.period);
      }
    }
    return wanted;
  }

  Time of_segment(const Task& chain, const std::vector<const Task::Part*>& segment) const {
    const Task::Part& least = least_urgent(segment);
    Time own = blocking(chain, least);
    for (const Task::Part* part : segment) own = plus(own, part->execution);
    return least_fixed_point(
        [&](Time window) { return plus(own, interference(chain, least, window)); }, set_.limit,
        own);
  }

  Time blocking(const Task& chain, const Task::Part& least) const {
    Time longest = 0;
    for (const Task& other : set_.tasks) {
      if (&other == &chain) continue;
      for (const Task::Part& part : other.parts) {
        if (part.executor != least.executor || part.priority >= least.priority) continue;
        longest = std::max(longest, part.execution);
      }
    }
    return longest;
  }

  Time interference(const Task& chain, const Task::Part& least, Time window) const {
    Time work = 0;
    for (const Task& other : set_.tasks) {
      const bool is_whole = is_on_one_cpu(other);
      if (&other == &chain && is_whole) continue;
      const Time period = is_whole ? std::max(other.period, other.execution) : other.period;
      const Task::Part& timer = other.parts.front();
      const bool comes_again = cpu(timer) != cpu(least) || urgency(timer) >= urgency(least);
      const Count instances = comes_again ? (window + period - 1) / period : 1;
      for (const Task::Part& part : other.parts) {
        if (&part == &least || cpu(part) != cpu(least) || urgency(part) <= urgency(least)) continue;
        work = plus(work, times(part.execution, instances));
      }
    }
    return work;
  }

  const TaskSet& set_;
};

Result chains(const TaskSet& set) {
  const Picas picas(set);
  return for_each_task(set, [&](std::size_t i) { return picas.response(set.tasks[i]); });
}

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "picas", "Chains over priority-driven executors on several CPUs", chains,
    .assumes =
        "executors are threads of different priorities under SCHED_FIFO, pinned; no polling "
        "points; timers come without jitter",
    .source = "Choi, Xiang, Kim, RTAS 2021", .keys = "callbacks T [D]", .settings = "executors",
    .example = R"({"executors": [{"cpu": 0, "priority": 1}],
 "tasks": [{"T": 20, "callbacks": [{"C": 2, "executor": 0, "priority": 3},
                                  {"C": 3, "executor": 0, "priority": 4}]},
           {"T": 50, "callbacks": [{"C": 4, "executor": 0, "priority": 1},
                                  {"C": 6, "executor": 0, "priority": 2}]}]})",
    .bounds_some = true,
    .takt =
        "optimistic if a chain has several CPUs: what one CPU delays, comes with jitter to the "
        "next")

}  // namespace takt::analysis::textbook
