// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/textbook/textbook.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace takt::analysis::textbook {

AnalysisRegistry& analyses() {
  static AnalysisRegistry registry("textbook analysis");
  return registry;
}

namespace {

double ratio(Time part, Time whole) {
  return static_cast<double>(part) / static_cast<double>(whole);
}

// Then no busy window ends. A little more than 1 may be due to the sum of fractions.
void refuse_overload(const TaskSet& set) {
  double wanted = 0;
  for (const Task& task : set.tasks) wanted += ratio(task.execution, task.period);
  const double available = set.reservation ? ratio(set.reservation->budget, set.reservation->period)
                                           : static_cast<double>(set.processors);
  if (wanted <= available * (1 + 1e-9)) return;
  throw Error(
      fmt::format("the tasks want {:.3f} of a processor, and there is {:.3f}", wanted, available),
      "no bound exists then: shorten C, or lengthen T");
}

}  // namespace

Result analyse(const std::string& name, const TaskSet& set) {
  const auto analysis = analyses().make(name);
  if (!analyses().traits(name).bounds_some) refuse_overload(set);
  Result result = analysis->analyse(set);
  const auto& found = result.responses;
  const bool bounds_some = std::any_of(found.begin(), found.end(), [](const Response& response) {
    return response.bound < kUnbounded;
  });
  if (!bounds_some && result.points.empty()) refuse_overload(set);
  return result;
}

}  // namespace takt::analysis::textbook
