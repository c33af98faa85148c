// SPDX-License-Identifier: Apache-2.0
#include "random/task_sets.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/analysis/textbook/textbook.hpp"
#include "takt/base/error.hpp"

#include "random/dice.hpp"

namespace takt::tools {
namespace {

using nlohmann::ordered_json;

/// Keys as the traits of an analysis list them, without the brackets of those that may be left out.
std::set<std::string> keys_in(const std::string& text) {
  std::istringstream words(text);
  std::set<std::string> keys;
  for (std::string word; words >> word;) {
    std::erase_if(word, [](char character) { return character == '[' || character == ']'; });
    keys.insert(word);
  }
  return keys;
}

bool can_be_drawn(const std::string& method, std::size_t processors) {
  const analysis::textbook::AnalysisTraits traits = analysis::textbook::analyses().traits(method);
  const std::set<std::string> known{"C", "C_min", "T", "O", "J", "D", "Y", "priority"};
  const std::set<std::string> keys = keys_in(traits.keys);
  return keys.contains("T") && keys.contains("C") &&
         std::includes(known.begin(), known.end(), keys.begin(), keys.end()) &&
         (processors == 1 || keys_in(traits.settings).contains("m"));
}

}  // namespace

void check_task_sets_for(const TaskSetOptions& options) {
  if (can_be_drawn(options.method, options.processors)) return;
  std::vector<std::string> valid = analysis::textbook::analyses().names();
  std::erase_if(valid,
                [&](const std::string& name) { return !can_be_drawn(name, options.processors); });
  throw Error(fmt::format("no task sets {}are drawn for '{}'",
                          options.processors == 1 ? "" : "for several processors ", options.method),
              fmt::format("name one of: {}", fmt::join(valid, ", ")));
}

ordered_json random_task_set(const TaskSetOptions& options, std::size_t number) {
  // Seeds that are next to each other give sets that have nothing in common.
  Dice dice(options.seed * 1'000'003 + number);
  const double utilisation =
      options.least_utilisation +
      (options.most_utilisation - options.least_utilisation) * dice.below_one();
  struct Task {
    std::int64_t execution, period;
  };
  std::vector<Task> tasks;
  for (const double share : dice.shares_up_to_one(options.tasks, utilisation)) {
    const std::int64_t period = std::int64_t{1000} * dice.period_ms();
    const auto execution = std::llround(share * static_cast<double>(period));
    tasks.push_back({std::max<std::int64_t>(1, execution), period});
  }
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const Task& a, const Task& b) { return a.period < b.period; });
  const std::set<std::string> keys =
      keys_in(analysis::textbook::analyses().traits(options.method).keys);
  double written = 0;  // of whole microseconds
  for (const Task& task : tasks) {
    written += static_cast<double>(task.execution) / static_cast<double>(task.period);
  }
  ordered_json set{{"id", number}, {"utilisation", std::round(written * 1e6) / 1e6}};
  if (options.processors != 1) set["m"] = options.processors;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    ordered_json task{{"C", tasks[i].execution}, {"T", tasks[i].period}};
    if (keys.contains("C_min")) task["C_min"] = (tasks[i].execution + 1) / 2;
    if (keys.contains("D")) task["D"] = tasks[i].period;
    if (keys.contains("Y")) task["Y"] = tasks[i].period;
    if (keys.contains("priority")) task["priority"] = tasks.size() - i;
    set["tasks"].push_back(std::move(task));
  }
  return set;
}

}  // namespace takt::tools
