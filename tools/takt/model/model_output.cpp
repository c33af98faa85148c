// A measured model as a file, as JSON and as tables.
// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "takt/measuring/rounds.hpp"

#include "model/extraction.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// For people, and exact: "1.234567ms".
std::string text_of(Nanoseconds time) {
  const double ns = static_cast<double>(time.count());
  if (time >= std::chrono::seconds(1)) return fmt::format("{}s", ns / 1e9);
  if (time >= std::chrono::milliseconds(1)) return fmt::format("{}ms", ns / 1e6);
  if (time >= std::chrono::microseconds(1)) return fmt::format("{}us", ns / 1e3);
  return fmt::format("{}ns", time.count());
}

/// Writes keys whose value is known.
class ModelWriter {
 public:
  std::string text(const MeasuredModel& model) {
    out_ << YAML::Comment("Measured by Takt; `takt analyze --model` and the key `model` read it.");
    out_ << YAML::BeginMap;
    value("file", model.file);
    value("machine", model.machine);
    time("duration", model.duration);
    value("margin", fmt::format("{:g}", model.margin));
    if (model.lost_executions != 0) value("lost_executions", model.lost_executions);
    begin("overheads");
    time("dispatch", model.dispatch_overhead);
    time("wake", model.wake_overhead);
    end();
    begin("chains");
    for (const MeasuredChain& chain : model.chains) write(chain);
    end();
    begin("callbacks");
    for (const MeasuredCallback& callback : model.callbacks) write(callback);
    end();
    out_ << YAML::EndMap;
    return out_.c_str();
  }

 private:
  void begin(const std::string& name) {
    out_ << YAML::Key << name << YAML::Value << YAML::BeginMap;
  }
  void begin_line(const std::string& name) {
    out_ << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap;
  }
  void end() { out_ << YAML::EndMap; }

  template <class Value>
  void value(const std::string& name, const Value& value) {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void time(const std::string& name, Nanoseconds time) {
    if (time != Nanoseconds::zero()) value(name, text_of(time));
  }

  void write(const MeasuredChain& chain) {
    begin_line(chain.name);
    value("instances", chain.instances);
    time("p50", chain.median);
    time("p99", chain.p99);
    time("p99.9", chain.p999);
    time("max", chain.longest);
    end();
  }

  void write(const MeasuredCallback& callback) {
    begin(callback.name);
    value("executions", callback.executions);
    if (callback.executions != 0) {
      begin_line("execution");
      time("min", callback.least_execution);
      time("p50", callback.median_execution);
      time("p99", callback.p99_execution);
      time("max", callback.longest_execution);
      time("first_ten", callback.longest_first_execution);
      end();
    }
    if (!callback.least_distances.empty()) {
      begin("arrival");
      time("period", callback.period);
      time("jitter", callback.jitter);
      out_ << YAML::Key << "distances" << YAML::Value << YAML::Flow << YAML::BeginSeq;
      for (const Nanoseconds distance : callback.least_distances) out_ << text_of(distance);
      out_ << YAML::EndSeq;
      end();
    }
    if (callback.dropped != 0) value("dropped", callback.dropped);
    if (!callback.causes.empty()) {
      begin("causes");
      for (const auto& [name, count] : callback.causes) value(name, count);
      end();
    }
    end();
  }

  YAML::Emitter out_;
};

json us_or_null(Nanoseconds time) {
  return time == Nanoseconds::zero() ? json() : json(rt::us(time));
}

std::string us_or_dash(Nanoseconds time) {
  return time == Nanoseconds::zero() ? "-" : microseconds(time);
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
            {"first_ten", us_or_null(callback.longest_first_execution)}}},
          {"period_us", us_or_null(callback.period)},
          {"jitter_us",
           callback.period == Nanoseconds::zero() ? json() : json(rt::us(callback.jitter))},
          {"distances_us", std::move(distances)},
          {"dropped", callback.dropped},
          {"causes", callback.causes}};
}

}  // namespace

void write_measured_model(const MeasuredModel& model, const std::string& path) {
  std::ofstream file(path);
  file << ModelWriter().text(model) << "\n";
  file.close();
  if (!file) throw not_written("the model", path);
}

json model_json(const MeasuredModel& model) {
  json callbacks = json::array(), chains = json::array();
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
           {{"dispatch", us_or_null(model.dispatch_overhead)},
            {"wake", us_or_null(model.wake_overhead)}}},
          {"callbacks", std::move(callbacks)},
          {"chains", std::move(chains)}};
}

void print_model(const MeasuredModel& model) {
  Table table({"callback", "executions", "exec_min", "exec_p50", "exec_p99", "exec_max", "period",
               "jitter", "closest", "dropped", "causes"});
  for (const MeasuredCallback& callback : model.callbacks) {
    std::vector<std::string> causes;
    for (const auto& [name, count] : callback.causes) {
      causes.push_back(count == 1 ? name : fmt::format("{} ({})", name, count));
    }
    table.add(
        {callback.name, std::to_string(callback.executions), us_or_dash(callback.least_execution),
         us_or_dash(callback.median_execution), us_or_dash(callback.p99_execution),
         us_or_dash(callback.longest_execution), us_or_dash(callback.period),
         callback.period == Nanoseconds::zero() ? "-" : microseconds(callback.jitter),
         callback.least_distances.empty() ? "-" : microseconds(callback.least_distances.front()),
         std::to_string(callback.dropped),
         causes.empty() ? "-" : fmt::format("{}", fmt::join(causes, ", "))});
  }
  table.print("callbacks (CPU time of executions, arrivals; in µs)");
  fmt::print(
      "overheads (estimated from real-time threads, in µs): {} between two callbacks, {} to "
      "wake a thread\n",
      us_or_dash(model.dispatch_overhead), us_or_dash(model.wake_overhead));
  if (model.lost_executions != 0) {
    fmt::print(
        "lost: the {} oldest executions, as a thread's trace was full: the model is of what "
        "came after them\n",
        model.lost_executions);
  }
}

}  // namespace takt::tools
