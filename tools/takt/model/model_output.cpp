// A measured model as a file, as JSON and as tables.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/output_file.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "model/extraction.hpp"
#include "run/result_json.hpp"
#include "table.hpp"
#include "yaml_file.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

void add_time(ordered_json& object, const char* key, Nanoseconds time) {
  if (time != Nanoseconds::zero()) object[key] = to_string(time);
}

ordered_json document(const MeasuredChain& chain) {
  ordered_json result{{"instances", chain.instances}};
  add_time(result, "p50", chain.median);
  add_time(result, "p99", chain.p99);
  add_time(result, "p99.9", chain.p999);
  add_time(result, "max", chain.longest);
  return result;
}

ordered_json document(const MeasuredCallback& callback) {
  ordered_json result{{"executions", callback.executions}};
  if (callback.executions != 0) {
    ordered_json& execution = result["execution"];
    add_time(execution, "min", callback.least_execution);
    add_time(execution, "p50", callback.median_execution);
    add_time(execution, "p99", callback.p99_execution);
    add_time(execution, "max", callback.longest_execution);
    add_time(execution, "first_ten", callback.longest_first_execution);
    if (callback.longest_wait) execution["waits"] = to_string(*callback.longest_wait);
  }
  if (!callback.least_distances.empty()) {
    ordered_json& arrival = result["arrival"];
    add_time(arrival, "period", callback.period);
    add_time(arrival, "jitter", callback.jitter);
    for (const Nanoseconds distance : callback.least_distances) {
      arrival["distances"].push_back(to_string(distance));
    }
  }
  if (callback.dropped != 0) result["dropped"] = callback.dropped;
  if (callback.uncaused != 0) {
    ordered_json& uncaused = result["uncaused"];
    uncaused["executions"] = callback.uncaused;
    for (const Nanoseconds distance : callback.uncaused_distances) {
      uncaused["distances"].push_back(to_string(distance));
    }
  }
  for (const auto& [name, count] : callback.causes) result["causes"][name] = count;
  return result;
}

ordered_json document(const MeasuredTimes& overhead) {
  ordered_json result;
  add_time(result, "min", overhead.least);
  add_time(result, "p10", overhead.p10);
  add_time(result, "p50", overhead.median);
  add_time(result, "p90", overhead.p90);
  add_time(result, "p99", overhead.p99);
  add_time(result, "p99.9", overhead.longest);
  return result;
}

/// As read_measured_model reads it: what is not known is not there.
ordered_json document(const MeasuredModel& model) {
  ordered_json result{{"file", model.file}, {"machine", model.machine}};
  add_time(result, "duration", model.duration);
  add_time(result, "total_duration", model.total_duration);
  result["margin"] = model.margin;
  if (model.lost_executions != 0) result["lost_executions"] = model.lost_executions;
  ordered_json overheads;
  for (const auto& [key, times] :
       {std::pair{"dispatch", &model.dispatch_overhead}, std::pair{"wake", &model.wake_overhead}}) {
    if (times->longest != Nanoseconds::zero()) overheads[key] = document(*times);
  }
  if (!overheads.empty()) result["overheads"] = std::move(overheads);
  for (const MeasuredExecutor& executor : model.executors) {
    result["executors"][executor.name] = {{"type", executor.type},
                                          {"scheduler", executor.scheduler},
                                          {"callbacks", executor.callbacks}};
  }
  for (const MeasuredComponent& component : model.components) {
    result["components"][component.node] = component.digest;
  }
  if (!model.active_nodes.empty()) result["active_nodes"] = model.active_nodes;
  for (const auto& [key, value] : model.settings) result["settings"][key] = value;
  for (const MeasuredChain& chain : model.chains) result["chains"][chain.name] = document(chain);
  result["callbacks"] = ordered_json::object();
  for (const MeasuredCallback& callback : model.callbacks) {
    result["callbacks"][callback.name] = document(callback);
  }
  return result;
}

json us_or_null(Nanoseconds time) {
  return time == Nanoseconds::zero() ? json() : json(rt::us(time));
}

std::string us_or_dash(Nanoseconds time) {
  return time == Nanoseconds::zero() ? "-" : microseconds(time);
}

json overhead_json(const MeasuredTimes& overhead) {
  return {{"min", us_or_null(overhead.least)},  {"p10", us_or_null(overhead.p10)},
          {"p50", us_or_null(overhead.median)}, {"p90", us_or_null(overhead.p90)},
          {"p99", us_or_null(overhead.p99)},    {"p999", us_or_null(overhead.longest)}};
}

json callback_json(const MeasuredCallback& callback) {
  json distances = json::array();
  for (const Nanoseconds distance : callback.least_distances) distances.push_back(rt::us(distance));
  return {{"callback", callback.name},
          {"executions", callback.executions},
          {"execution_us",
           {{"min", us_or_null(callback.least_execution)},
            {"p50", us_or_null(callback.median_execution)},
            {"p99", us_or_null(callback.p99_execution)},
            {"max", us_or_null(callback.longest_execution)},
            {"first_ten", us_or_null(callback.longest_first_execution)},
            {"waits", us_or_null(callback.longest_wait.value_or(Nanoseconds{0}))}}},
          {"period_us", us_or_null(callback.period)},
          {"jitter_us",
           callback.period == Nanoseconds::zero() ? json() : json(rt::us(callback.jitter))},
          {"distances_us", std::move(distances)},
          {"dropped", callback.dropped},
          {"uncaused", callback.uncaused},
          {"causes", callback.causes}};
}

}  // namespace

void write_measured_model(const MeasuredModel& model, const std::string& path) {
  write_output(path, fmt::format("# {} model: for `takt analyze --model`, or the key `model` of a "
                                 "configuration file.\n{}",
                                 kTaktsText, yaml_file(document(model))));
}

json model_json(const MeasuredModel& model) {
  json callbacks = json::array(), chains = json::array(), executors = json::object();
  for (const MeasuredExecutor& executor : model.executors) {
    executors[executor.name] = {{"type", executor.type},
                                {"scheduler", executor.scheduler},
                                {"callbacks", executor.callbacks}};
  }
  for (const MeasuredCallback& callback : model.callbacks) {
    callbacks.push_back(callback_json(callback));
  }
  for (const MeasuredChain& chain : model.chains) {
    chains.push_back({{"name", chain.name},
                      {"instances", chain.instances},
                      {"latency_us",
                       {{"p50", rt::us(chain.median)},
                        {"p99", rt::us(chain.p99)},
                        {"p999", rt::us(chain.p999)},
                        {"max", rt::us(chain.longest)}}}});
  }
  return {{"file", model.file},
          {"machine", model.machine},
          {"duration_s", rt::us(model.duration) / 1e6},
          {"margin", model.margin},
          {"lost_executions", model.lost_executions},
          {"overheads_us",
           {{"dispatch", overhead_json(model.dispatch_overhead)},
            {"wake", overhead_json(model.wake_overhead)}}},
          {"executors", std::move(executors)},
          {"callbacks", std::move(callbacks)},
          {"chains", std::move(chains)}};
}

void print_model(const MeasuredModel& model) {
  Table table({"callback", "executions", "exec_min", "exec_p50", "exec_p99", "exec_max", "waits",
               "period", "jitter", "closest", "dropped", "causes"});
  for (const MeasuredCallback& callback : model.callbacks) {
    std::vector<std::string> causes;
    for (const auto& [name, count] : callback.causes) {
      causes.push_back(count == 1 ? name : fmt::format("{} ({})", name, count));
    }
    table.add(
        {callback.name, std::to_string(callback.executions), us_or_dash(callback.least_execution),
         us_or_dash(callback.median_execution), us_or_dash(callback.p99_execution),
         us_or_dash(callback.longest_execution),
         us_or_dash(callback.longest_wait.value_or(Nanoseconds{0})), us_or_dash(callback.period),
         callback.period == Nanoseconds::zero() ? "-" : microseconds(callback.jitter),
         callback.least_distances.empty() ? "-" : microseconds(callback.least_distances.front()),
         std::to_string(callback.dropped),
         causes.empty() ? "-" : fmt::format("{}", fmt::join(causes, ", "))});
  }
  table.print("callbacks (CPU time of executions, arrivals; in µs)");
  rt::print(
      "overheads (estimated from real-time threads, p99.9, in µs): {} between two callbacks "
      "(p50 {}), {} to wake a thread (p50 {})\n",
      us_or_dash(model.dispatch_overhead.longest), us_or_dash(model.dispatch_overhead.median),
      us_or_dash(model.wake_overhead.longest), us_or_dash(model.wake_overhead.median));
  if (model.lost_executions != 0) {
    rt::print(
        "lost: the {} oldest executions, as a thread's trace was full: the model is of what "
        "came after them\n",
        model.lost_executions);
  }
}

}  // namespace takt::tools
