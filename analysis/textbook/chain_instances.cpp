// Chains on several threads, of which the instance with the least deadline goes first: CIL-EDF, by
// the authors' later formulas for constrained and for arbitrary deadlines. Without groups of mutual
// exclusion.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

using Interference = Time (*)(const TaskSet&, const Task&, Time window);

Count rounded_up(Time part, Time whole) {
  return (part + whole - 1) / whole;
}

Time of_constrained(const TaskSet& set, const Task& chain, Time window) {
  Time work = 0;
  for (const Task& other : set.tasks) {
    if (*other.deadline < *chain.deadline) {
      work = plus(work, times(other.execution, window / other.period));
      work = plus(work, std::min(other.execution, window % other.period));
    }
    if (&other != &chain) work = plus(work, std::min(other.execution, window));
  }
  return work;
}

Time of_arbitrary(const TaskSet& set, const Task& chain, Time window) {
  Time work = -std::min(chain.execution, window);
  for (const Task& other : set.tasks) {
    if (*other.deadline < *chain.deadline) {
      work = plus(work, times(other.execution, rounded_up(window, other.period)));
    }
    work = plus(
        work, times(std::min(other.execution, window), rounded_up(*other.deadline, other.period)));
  }
  return work;
}

Result by_instances(const TaskSet& set, Interference interference) {
  return for_each_task(set, [&](std::size_t i) {
    const Task& chain = set.tasks[i];
    const Time before = chain.execution - chain.last;
    // The last callback begins when so much is less than what all threads can do.
    const Time begins = least_fixed_point(
        [&](Time window) {
          const Time work = plus(times(set.processors, before), interference(set, chain, window));
          return work / set.processors + 1;
        },
        set.limit, before);
    return Response{.bound = plus(begins, chain.last - 1)};
  });
}

Result constrained(const TaskSet& set) {
  for (const Task& chain : set.tasks) {
    if (*chain.deadline <= chain.period) continue;
    throw Error("'" + chain.name + "' has a deadline D beyond its period T",
                "use cil_edf_arbitrary");
  }
  return by_instances(set, of_constrained);
}
Result arbitrary(const TaskSet& set) {
  return by_instances(set, of_arbitrary);
}

}  // namespace

TAKT_REGISTER_TEXTBOOK("cil_edf_constrained",
                       "Chains on several threads by the instance's deadline, D ≤ T", constrained,
                       .assumes = "one deadline for an instance of a chain; no groups",
                       .source = "CIL-EDF, with its authors' erratum", .keys = "wcets T D",
                       .settings = "m",
                       .example = R"({"m": 2, "tasks": [{"wcets": [2, 3], "T": 20, "D": 20},
                   {"wcets": [4], "T": 30, "D": 30}]})",
                       .takt = "no executor orders by the deadline of a chain's instance")

TAKT_REGISTER_TEXTBOOK("cil_edf_arbitrary", "Chains on several threads by the instance's deadline",
                       arbitrary, .assumes = "one deadline for an instance of a chain; no groups",
                       .source = "CIL-EDF, with its authors' erratum", .keys = "wcets T D",
                       .settings = "m",
                       .example = R"({"m": 2, "tasks": [{"wcets": [2, 3], "T": 20, "D": 20},
                   {"wcets": [4], "T": 30, "D": 30}]})",
                       .takt = "no executor orders by the deadline of a chain's instance")

}  // namespace takt::analysis::textbook
