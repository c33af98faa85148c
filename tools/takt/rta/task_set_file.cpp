// SPDX-License-Identifier: Apache-2.0
#include "rta/task_set_file.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt::tools {
namespace {

using analysis::Time;
using analysis::textbook::Task;
using analysis::textbook::TaskSet;
using document::Value;

// Sums of such numbers are far from what the type holds.
// Limit: numbers in a task set of `takt rta`. At it: a larger one is refused. Seen: the error.
constexpr Time kMost = 1'000'000'000'000'000;

/// The keys of a map, as "C T [J]" says them.
struct Keys {
  explicit Keys(const std::string& text) {
    std::istringstream words(text);
    for (std::string word; words >> word;) {
      const bool is_optional = word.front() == '[';
      if (is_optional) word = word.substr(1, word.size() - 2);
      all.push_back(word);
      if (!is_optional) required.push_back(word);
    }
  }
  std::vector<std::string> all, required;
};

class TaskSetReader {
 public:
  TaskSetReader(const std::string& analysis, document::Errors& errors)
      : analysis_(analysis),
        traits_(analysis::textbook::analyses().traits(analysis)),
        errors_(errors) {}

  TaskSet read(const Value& file) {
    std::string settings = traits_.settings + " [limit]";
    if (!traits_.keys.empty()) settings += " tasks";
    document::check_is_ours(file, Keys(settings).all, errors_);
    // Executors first: callbacks refer to them.
    each_key(file, "the task set", settings, [&](const Value& value) {
      if (value.name == "executors") list(value, [&](const Value& one) { executor(one); });
    });
    if (const auto* map = std::get_if<document::Map>(&file.content)) {
      for (const Value& value : map->values) setting(value);
    }
    return std::move(set_);
  }

 private:
  using Use = std::function<void(const Value&)>;

  // Complains of keys that are missing, or that nothing reads.
  void each_key(const Value& map, const std::string& of, const std::string& text, const Use& use) {
    const Keys keys(text + (of == "the task set" ? "" : " [name]"));
    const auto* const values = std::get_if<document::Map>(&map.content);
    if (values == nullptr) {
      errors_.add(map.line, fmt::format("{} is not a map", of),
                  fmt::format("write {{\"{}\": …}}", keys.all.front()));
      return;
    }
    for (const Value& value : values->values) {
      if (std::find(keys.all.begin(), keys.all.end(), value.name) != keys.all.end()) {
        use(value);
      } else {
        errors_.add(value.line, fmt::format("{}: {} reads no '{}'", of, analysis_, value.name),
                    suggest(value.name, keys.all));
      }
    }
    for (const std::string& key : keys.required) {
      if (document::find(map, key) == nullptr) {
        errors_.add(map.line, fmt::format("{}: '{}' is missing", of, key),
                    fmt::format("give it; takt rta {} --help shows an example", analysis_));
      }
    }
  }

  void list(const Value& value, const Use& use) {
    const auto* const values = std::get_if<document::List>(&value.content);
    if (values == nullptr || values->empty()) {
      errors_.add(value.line, fmt::format("'{}' is not a list, or an empty one", value.name),
                  "write [ … ] with one entry at least");
      return;
    }
    for (const Value& one : *values) use(one);
  }

  std::int64_t number(const Value& value, std::int64_t least, std::int64_t most = kMost) {
    const auto* const found = std::get_if<std::int64_t>(&value.content);
    if (found != nullptr && *found >= least && *found <= most) return *found;
    const std::string what =
        std::holds_alternative<double>(value.content) ? "is not a whole number" : "is not possible";
    errors_.add(value.line, fmt::format("'{}' {}", value.name, what),
                fmt::format("give a whole number from {} to {}, in any unit of time that is the "
                            "same for all",
                            least, most));
    return least;
  }

  void setting(const Value& value) {
    if (value.name == "tasks") list(value, [&](const Value& one) { task(one); });
    if (value.name == "supply") supply(value);
    if (value.name == "B") set_.blocking = number(value, 0);
    if (value.name == "m") set_.processors = number(value, 1, 1024);
    if (value.name == "until") set_.until = number(value, 1, 100'000);
    if (value.name == "limit") set_.limit = number(value, 1);
  }

  void supply(const Value& value) {
    analysis::Reservation found{};
    each_key(value, "'supply'", "[dedicated] [budget] [period]", [&](const Value& one) {
      if (one.name == "budget") found.budget = number(one, 1);
      if (one.name == "period") found.period = number(one, 1);
    });
    const Value* const dedicated = document::find(value, "dedicated");
    if (dedicated != nullptr && found.budget == 0 && found.period == 0 &&
        std::holds_alternative<bool>(dedicated->content) && std::get<bool>(dedicated->content)) {
      return;
    }
    if (dedicated == nullptr && found.budget > 0 && found.budget <= found.period) {
      set_.reservation = found;
      return;
    }
    errors_.add(value.line, "'supply' is neither a processor nor a part of one",
                R"(give {"dedicated": true}, or {"budget": 3, "period": 5} with budget ≤ period)");
  }

  void executor(const Value& value) {
    TaskSet::Executor found;
    each_key(value, value.name, "cpu priority", [&](const Value& one) {
      if (one.name == "cpu") found.cpu = static_cast<int>(number(one, 0, 1023));
      if (one.name == "priority") found.priority = number(one, -kMost);
    });
    for (const TaskSet::Executor& other : set_.executors) {
      if (other.cpu != found.cpu || other.priority != found.priority) continue;
      errors_.add(
          value.line,
          fmt::format("two executors of CPU {} have priority {}", found.cpu, found.priority),
          "the analysis needs different ones");
    }
    set_.executors.push_back(found);
  }

  void task(const Value& value) {
    Task found;
    found.name = fmt::format("task {}", set_.tasks.size());
    each_key(value, value.name, traits_.keys, [&](const Value& one) { key(one, found); });
    if (found.shortest > found.execution && found.execution != 0) {
      errors_.add(value.line, fmt::format("{}: 'C_min' is above 'C'", value.name), "exchange them");
    }
    set_.tasks.push_back(std::move(found));
  }
  void key(const Value& value, Task& task) {
    const std::string& name = value.name;
    if (name == "name") task.name = word(value, {});
    if (name == "C") task.execution = task.last = number(value, 1);
    if (name == "C_min") task.shortest = number(value, 0);
    if (name == "T") task.period = number(value, 1);
    if (name == "O") task.offset = number(value, 0);
    if (name == "J") task.jitter = number(value, 0);
    if (name == "D") task.deadline = number(value, 1);
    if (name == "Y") task.point = number(value, 0);
    if (name == "priority") task.priority = number(value, -kMost);
    if (name == "order") task.place = number(value, 0);
    if (name == "kind") task.is_timer = word(value, {"timer", "subscription"}) == "timer";
    if (name == "wcets") {
      list(value, [&](const Value& one) {
        task.last = number(one, 1);
        task.execution += task.last;
      });
    }
    if (name == "callbacks") list(value, [&](const Value& one) { part(one, task); });
  }
  std::string word(const Value& value, const std::vector<std::string>& valid) {
    const auto* const text = std::get_if<std::string>(&value.content);
    if (text != nullptr &&
        (valid.empty() || std::find(valid.begin(), valid.end(), *text) != valid.end())) {
      return *text;
    }
    errors_.add(
        value.line, fmt::format("'{}' is not possible", value.name),
        valid.empty() ? "give a text" : fmt::format("give one of: {}", fmt::join(valid, ", ")));
    return "";
  }
  void part(const Value& value, Task& task) {
    Task::Part found;
    each_key(value, value.name, "C executor priority", [&](const Value& one) {
      if (one.name == "C") found.execution = number(one, 1);
      if (one.name == "priority") found.priority = number(one, -kMost);
      if (one.name == "executor") {
        const auto most =
            std::max<std::int64_t>(1, static_cast<std::int64_t>(set_.executors.size()));
        found.executor = static_cast<std::size_t>(number(one, 0, most - 1));
      }
    });
    task.parts.push_back(found);
    task.execution += found.execution;
    task.last = found.execution;
  }

  const std::string analysis_;
  const analysis::textbook::AnalysisTraits traits_;
  document::Errors& errors_;
  TaskSet set_;
};

}  // namespace

TaskSet read_task_set(const Value& file, const std::string& analysis, document::Errors& errors) {
  TaskSet set = TaskSetReader(analysis, errors).read(file);
  errors.throw_if_any();
  return set;
}

}  // namespace takt::tools
