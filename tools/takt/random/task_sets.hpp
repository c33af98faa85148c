// Random task sets for textbook analyses.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RANDOM_TASK_SETS_HPP_
#define TAKT_TOOLS_TAKT_RANDOM_TASK_SETS_HPP_

#include <cstddef>
#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

struct TaskSetOptions {
  std::uint64_t seed = 0;
  std::string method;  // of `takt rta`, which is to read them
  std::size_t tasks = 5, processors = 1;
  double least_utilisation = 0.05, most_utilisation = 1;  // of all processors
};

/// Throws Error unless the method reads sets of tasks with no more than their C, T, J, D, Y, O and
/// priority, and `m` if there are several processors.
void check_task_sets_for(const TaskSetOptions& options);

/// One set, of this number: the same options give the same one. Times in µs; utilisations by
/// UUniFast, or above 1 by RandFixedSum; periods as in cars (WATERS 2015), deadlines are periods,
/// the shorter period is the more urgent one, and the shortest execution half of the longest.
/// Thread safety: a pure function. Real-time: no.
nlohmann::ordered_json random_task_set(const TaskSetOptions& options, std::size_t number);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RANDOM_TASK_SETS_HPP_
