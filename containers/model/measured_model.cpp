// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/measured_model.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/model/measured_relations.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

// Keeps sums and products of the file's times from overflowing.
constexpr Nanoseconds kLongest = 10'000h;
// Limit: the `margin` of a model file. At it: a larger one is refused. Seen: the error.
constexpr double kMostMargin = 10;

/// Reads a *.model.yaml.
class ModelReader : private SystemReader {
 public:
  explicit ModelReader(Reading& file) : SystemReader(file) {}

  MeasuredModel read(const Value& root) {
    MeasuredModel model;
    read_root(
        root, "a measured model",
        {{"file", "", into(model.file)},
         {"machine", "", into(model.machine)},
         {"duration", "", into_time(model.duration)},
         {"total_duration", "", into_time(model.total_duration)},
         {"margin", "", into_margin(model.margin)},
         {"lost_executions", "", into_count(model.lost_executions)},
         {"overheads", "", into_overheads(model)},
         {"executors", "",
          each_in_map([&](const Value& value) { model.executors.push_back(executor(value)); })},
         {"components", "", each_in_map([&](const Value& value) {
            into(model.components.emplace_back(MeasuredComponent{.node = value.name, .digest = {}})
                     .digest)(value);
          })},
         {"active_nodes", "", each_in_list([&](const Value& value) {
            std::string name;
            into(name)(value);
            active_.emplace_back(value.line, name);
            model.active_nodes.insert(std::move(name));
          })},
         {"settings", "",
          each_in_map([&](const Value& value) { into(model.settings[value.name])(value); })},
         {"callbacks", "",
          each_in_map([&](const Value& value) { model.callbacks.push_back(callback(value)); }),
          /*is_required=*/true},
         {"chains", "",
          each_in_map([&](const Value& value) { model.chains.push_back(chain(value)); })}});
    check_names(model);
    if (errors_.size() == 0) check_relations(root, model);
    model.lines = std::move(lines_);
    return model;
  }

 private:
  enum class Zero { refused, allowed };

  /// What is not known is not in the file: 0 is a time only of what may take none.
  Read into_time(Nanoseconds& time, Zero zero = Zero::refused) {
    return [this, &time, zero](const Value& value) {
      const auto* text = std::get_if<std::string>(&value.content);
      if (text == nullptr) {
        return refuse(value, "a number and one of ns, us, ms, s, m, h, such as 20ms");
      }
      errors_.passes(value.line, [&] {
        const Nanoseconds read = parse_duration(*text);
        if (read > kLongest) {
          throw Error(fmt::format("'{}' is longer than {} h", *text, kLongest / 1h),
                      "write a time that can be measured");
        }
        if (read == Nanoseconds::zero() && zero == Zero::refused) {
          throw Error(fmt::format("'{}' is zero, but what was measured took time", value.name),
                      "leave it out if it is not known");
        }
        time = read;
      });
    };
  }

  Read into_count(std::uint64_t& count) {
    return [this, &count](const Value& value) {
      const auto* number = std::get_if<std::int64_t>(&value.content);
      if (number == nullptr || *number < 0) return refuse(value, "an integer from 0");
      count = static_cast<std::uint64_t>(*number);
    };
  }

  Read into_margin(double& margin) {
    return [this, &margin](const Value& value) {
      const auto* integer = std::get_if<std::int64_t>(&value.content);
      const auto* number = std::get_if<double>(&value.content);
      const double read = integer != nullptr  ? static_cast<double>(*integer)
                          : number != nullptr ? *number
                                              : -1;
      if (!(read >= 0 && read <= kMostMargin)) {
        return refuse(value, fmt::format("a number from 0 to {}: 0.2 is a fifth", kMostMargin));
      }
      margin = read;
    };
  }

  Read into_overheads(MeasuredModel& model) {
    return [this, &model](const Value& value) {
      read_map(value, "overheads",
               {{"dispatch", "", into_overhead(model.dispatch_overhead)},
                {"wake", "", into_overhead(model.wake_overhead)}});
    };
  }

  /// Reads either all percentiles of an overhead or p99.9 alone.
  Read into_overhead(MeasuredTimes& times) {
    return [this, &times](const Value& value) {
      if (!std::holds_alternative<document::Map>(value.content))
        return into_time(times.longest)(value);
      read_map(value, "a measured overhead",
               {{"min", "", into_time(times.least)},
                {"p10", "", into_time(times.p10)},
                {"p50", "", into_time(times.median)},
                {"p90", "", into_time(times.p90)},
                {"p99", "", into_time(times.p99)},
                {"p99.9", "", into_time(times.longest), /*is_required=*/true}});
    };
  }

  MeasuredExecutor executor(const Value& value) {
    MeasuredExecutor result{.name = value.name};
    read_map(value, "an executor of a measured run",
             {{"type", "", into(result.type), /*is_required=*/true},
              {"scheduler", "", into(result.scheduler), /*is_required=*/true},
              {"callbacks", "", each_in_list([&](const Value& name) {
                 into(result.callbacks.emplace_back())(name);
                 named_.emplace_back(name.line, result.callbacks.back());
               })}});
    return result;
  }

  MeasuredCallback callback(const Value& value) {
    MeasuredCallback result;
    bool has_none = false;
    result.name = value.name;
    lines_[value.name] = errors_.where(value.line);
    if (!value.name.starts_with('/') || value.name.find('/', 1) == std::string::npos) {
      errors_.add(value.line, fmt::format("'{}' names no callback", value.name),
                  "write its node and its name, as in /camera/image");
    }
    read_map(value, "a measured callback",
             {{"executions", "",
               [&](const Value& count) {
                 into_count(result.executions)(count);
                 has_none = result.executions == 0;
               }},
              {"execution", "", into_execution(result)},
              {"arrival", "", into_arrival(result)},
              {"dropped", "", into_count(result.dropped)},
              {"uncaused", "", into_uncaused(result)},
              {"causes", "", each_in_map([&](const Value& cause) {
                 named_.emplace_back(cause.line, cause.name);
                 into_count(result.causes[cause.name])(cause);
               })}});
    for (const char* const key : {"execution", "arrival", "uncaused", "causes"}) {
      if (has_none && document::find(value, key) != nullptr)
        complain(value, fmt::format("it has '{}' of 0 'executions'", key));
    }
    return result;
  }

  Read into_execution(MeasuredCallback& callback) {
    return [this, &callback](const Value& value) {
      read_map(value, "an execution time",
               {{"min", "", into_time(callback.least_execution)},
                {"p50", "", into_time(callback.median_execution)},
                {"p99", "", into_time(callback.p99_execution)},
                {"max", "", into_time(callback.longest_execution), /*is_required=*/true},
                {"first_ten", "", into_time(callback.longest_first_execution)},
                {"waits", "", [&](const Value& waits) {
                   into_time(callback.longest_wait.emplace(), Zero::allowed)(waits);
                 }}});
    };
  }

  Read into_arrival(MeasuredCallback& callback) {
    return [this, &callback](const Value& value) {
      read_map(value, "an arrival",
               {{"period", "", into_time(callback.period)},
                {"jitter", "", into_time(callback.jitter, Zero::allowed)},
                {"distances", "", into_distances(callback.least_distances)}});
    };
  }

  Read into_uncaused(MeasuredCallback& callback) {
    return [this, &callback](const Value& value) {
      read_map(value, "what no callback has caused",
               {{"executions", "", into_count(callback.uncaused), /*is_required=*/true},
                {"distances", "", into_distances(callback.uncaused_distances)}});
    };
  }

  Read into_distances(std::vector<Nanoseconds>& distances) {
    return [this, &distances](const Value& value) {
      const auto* list = std::get_if<document::List>(&value.content);
      if (list != nullptr && list->size() > MeasuredCallback::kMostDistances) {
        errors_.add(value.line, fmt::format("there are {} distances", list->size()),
                    fmt::format("write the first {}", MeasuredCallback::kMostDistances));
        return;
      }
      each_in_list([&](const Value& distance) {
        into_time(distances.emplace_back(), Zero::allowed)(distance);
      })(value);
    };
  }

  MeasuredChain chain(const Value& value) {
    MeasuredChain result{.name = value.name};
    lines_[value.name] = errors_.where(value.line);
    read_map(value, "a measured chain",
             {{"instances", "", into_count(result.instances)},
              {"p50", "", into_time(result.median)},
              {"p99", "", into_time(result.p99)},
              {"p99.9", "", into_time(result.p999)},
              {"max", "", into_time(result.longest), /*is_required=*/true}});
    if (document::find(value, "instances") != nullptr && result.instances == 0)
      complain(value, "it has latencies of 0 'instances'");
    return result;
  }

  void complain(const Value& value, const std::string& what) {
    if (what.empty()) return;
    errors_.add(value.line, fmt::format("'{}' contradicts itself: {}", value.name, what),
                "correct it, or measure again");
  }

  /// The callbacks that others cause, and those of executors, must be in the file, too, and so must
  /// nodes: otherwise a name is misspelt.
  void check_names(const MeasuredModel& model) {
    std::vector<std::string> names;
    for (const MeasuredCallback& callback : model.callbacks) names.push_back(callback.name);
    const std::set<std::string> known(names.begin(), names.end());
    for (const auto& [line, name] : named_) {
      if (known.contains(name)) continue;
      errors_.add(line, fmt::format("'{}' is not a callback of this file", name),
                  names.empty() ? "list it under 'callbacks'" : suggest(name, names));
    }
    if (model.components.empty()) return;
    std::vector<std::string> nodes;
    for (const MeasuredComponent& component : model.components) nodes.push_back(component.node);
    for (const auto& [line, name] : active_) {
      if (std::find(nodes.begin(), nodes.end(), name) != nodes.end()) continue;
      errors_.add(line, fmt::format("'{}' is not one of the 'components' of this file", name),
                  suggest(name, nodes));
    }
  }

  void check_relations(const Value& root, const MeasuredModel& model) {
    for (const Contradiction& found : contradictions(model)) {
      const Value* value = &root;
      for (const std::string& key : found.at) {
        const Value* const next = document::find(*value, key);
        if (next == nullptr) break;
        value = next;
      }
      complain(*value, found.what);
    }
  }

  std::vector<std::pair<int, std::string>> named_, active_;  // callbacks, nodes, with their lines
  std::map<std::string, std::string> lines_;
};

}  // namespace

MeasuredModel read_measured_model(const std::string& path) {
  document::Errors errors(path);
  const document::Value root = document::read(path, errors);
  Reading file{errors};
  MeasuredModel model = ModelReader(file).read(root);
  errors.throw_if_any();
  model.path = path;
  return model;
}

}  // namespace takt
