// SPDX-License-Identifier: Apache-2.0
#include "bench/reference_system.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "takt/base/histogram.hpp"
#include "takt/measuring/rounds.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// What a message carries of its history.
struct Sample {
  std::optional<double> root_ms, sink_ms;  // start of the later lidar; of the collision estimator
  std::uint64_t drops = 0;
  std::optional<std::size_t> planner;  // which execution of the planner's timer
};

/// One execution of a callback.
struct Execution {
  std::string node, input;  // input: the topic, or the name of the timer
  bool is_timer;
  double start_ms;
  std::uint64_t chain, drops;  // drops: messages overwritten in the queue before this one
};

std::vector<Execution> read_executions(const json& timeline) {
  std::vector<Execution> executions;
  for (const json& event : timeline.at("traceEvents")) {
    if (event.at("ph") != "X" || event.at("cat") == "sched") continue;  // else what a CPU ran
    const std::string name = event.at("name");
    const std::size_t slash = name.find('/', 1);
    const json& args = event.at("args");
    executions.push_back({name.substr(1, slash - 1), name.substr(slash + 1),
                          event.at("cat") == "timer", event.at("ts").get<double>() / 1e3,
                          args.at("chain_instance"), args.at("lost")});
  }
  std::stable_sort(executions.begin(), executions.end(),
                   [](const auto& a, const auto& b) { return a.start_ms < b.start_ms; });
  return executions;
}

/// Sends samples through the graph again, in the order of the executions.
class Replay {
 public:
  void execute(const Execution& execution) {
    if (execution.is_timer) return fire(execution);
    const Sample sample = sent_["/" + without_slash(execution.input)][execution.chain];
    if (execution.node == "PointCloudFusion" || execution.node == "VehicleInterface") {
      fuse(execution, sample);
    } else if (execution.node == "BehaviorPlanner") {
      if (execution.input == "/ObjectCollisionEstimator") for_planner_ = sample;
    } else if (execution.node == "VehicleDBWSystem" || execution.node == "IntersectionOutput") {
      ++arrived_;
      if (arrived_ > kSkipped && execution.node == "VehicleDBWSystem") samples_.push_back(sample);
    } else {
      relay(execution, sample);
    }
  }

  const std::vector<Sample>& samples() const { return samples_; }
  /// Starts of the planner's timer.
  const std::vector<double>& planner_ms() const { return planner_ms_; }

 private:
  static constexpr int kSkipped = 9;

  static std::string without_slash(const std::string& topic) {
    return topic.substr(topic.starts_with('/') ? 1 : 0);
  }

  static bool is_on_hot_path(const Execution& execution) {
    static const std::set<std::string> nodes{
        "PointsTransformerFront", "PointsTransformerRear",    "PointCloudFusion",
        "RayGroundFilter",        "EuclideanClusterDetector", "ObjectCollisionEstimator"};
    return nodes.contains(execution.node);
  }

  void fire(const Execution& timer) {
    Sample sample;
    if (timer.node == "FrontLidarDriver" || timer.node == "RearLidarDriver") {
      sample.root_ms = timer.start_ms;
    } else if (timer.node == "BehaviorPlanner") {
      sample = std::exchange(for_planner_, {});
      sample.planner = planner_ms_.size();
      planner_ms_.push_back(timer.start_ms);
    }
    sent_["/" + timer.node][timer.chain] = sample;
  }

  void relay(const Execution& execution, Sample sample) {
    if (is_on_hot_path(execution)) sample.drops += execution.drops;
    if (execution.node == "ObjectCollisionEstimator") sample.sink_ms = execution.start_ms;
    const bool is_settings = execution.input == "/EuclideanClusterSettings";
    sent_[is_settings ? "/EuclideanIntersection" : "/" + execution.node][execution.chain] = sample;
  }

  /// Waits for both inputs. A message that another replaces meanwhile is a drop, too.
  void fuse(const Execution& execution, const Sample& sample) {
    auto& inputs = fused_[execution.node];
    Input& input = inputs[execution.input];
    input.drops += execution.drops + (input.sample ? 1 : 0);
    input.sample = sample;
    const bool is_complete =
        inputs.size() == 2 &&
        std::all_of(inputs.begin(), inputs.end(), [](auto& each) { return each.second.sample; });
    if (!is_complete) return;
    Sample both;
    for (auto& [topic, each] : inputs) {
      both.root_ms = std::max(both.root_ms, each.sample->root_ms);
      both.drops += each.sample->drops + (is_on_hot_path(execution) ? each.drops : 0);
    }
    if (execution.node == "VehicleInterface") both = *inputs.at("/MPCController").sample;
    sent_["/" + execution.node][execution.chain] = both;
    inputs.clear();
  }

  struct Input {
    std::optional<Sample> sample;
    std::uint64_t drops = 0;
  };
  std::map<std::string, std::map<std::uint64_t, Sample>> sent_;  // topic → chain instance → sample
  std::map<std::string, std::map<std::string, Input>> fused_;  // node → topic
  Sample for_planner_;
  std::vector<double> planner_ms_;
  int arrived_ = 0;
  std::vector<Sample> samples_;
};

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation(const std::vector<double>& values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - middle) * (value - middle);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

}  // namespace

std::map<std::string, double> reference_figures(const rt::Run& run, const json& timeline) {
  Replay replay;
  for (const Execution& execution : read_executions(timeline)) replay.execute(execution);
  std::map<std::string, double> figures;
  std::vector<double> latencies_ms, periods_ms;
  std::uint64_t drops = 0;
  std::optional<std::size_t> before;
  for (const Sample& sample : replay.samples()) {
    if (sample.root_ms && sample.sink_ms) {
      latencies_ms.push_back(*sample.sink_ms - *sample.root_ms);
      drops += sample.drops;
    }
    if (sample.planner && before && *sample.planner > *before) {
      periods_ms.push_back((replay.planner_ms()[*sample.planner] - replay.planner_ms()[*before]) /
                           static_cast<double>(*sample.planner - *before));
    }
    if (sample.planner) before = sample.planner;
  }
  figures["hot_path_samples"] = static_cast<double>(latencies_ms.size());
  figures["hot_path_drops"] = static_cast<double>(drops);
  if (!latencies_ms.empty()) {
    figures["hot_path_ms"] = mean(latencies_ms);
    figures["hot_path_max_ms"] = *std::max_element(latencies_ms.begin(), latencies_ms.end());
  }
  if (periods_ms.size() >= 2) figures["planner_deviation_ms"] = deviation(periods_ms);
  Histogram from_release;
  for (const rt::Run::Chain& chain : run.chains) {
    if (chain.name == "hot_path_front") from_release.merge(chain.statistics.latency);
  }
  if (from_release.count() != 0) {
    figures["hot_path_release_ms"] = rt::us(from_release.percentile(0.5)) / 1e3;
    figures["hot_path_release_max_ms"] = rt::us(from_release.max()) / 1e3;
  }
  return figures;
}

}  // namespace takt::tools
