// SPDX-License-Identifier: Apache-2.0
#include "bench/figures.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "run/result_json.hpp"

namespace takt::tools {

using nlohmann::json;

Figures figures_of(const json& run, const Variant& variant) {
  Figures figures;
  double cpu = 0, pss = 0, received = 0, lost = 0;
  for (const json& process : run.at("processes")) {
    cpu += process.at("cpu_percent").get<double>();
    pss += process.at("pss_kb").get<double>();
  }
  for (const json& callback : run.at("callbacks")) {
    if (callback.at("kind") == "timer") continue;
    figures.latency.merge(read_histogram(callback.at("latency_us")));
    received += callback.at("received").get<double>();
    lost += callback.at("lost").get<double>();
  }
  figures.values = {{"pss_mb", pss / 1024},
                    {"cpu_percent", cpu},
                    {"latency_us", rt::us(figures.latency.mean())},
                    {"p50_us", rt::us(figures.latency.percentile(0.5))},
                    {"p99_us", rt::us(figures.latency.percentile(0.99))},
                    {"received", received},
                    {"lost", lost}};
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] = received * static_cast<double>(variant.message_bytes) / 1e6 /
                                     run.at("duration_s").get<double>();
  }
  return figures;
}

std::map<std::string, double> key_figures(const json& run, const json& timeline) {
  static const std::vector<std::string> hot_path{
      "/FrontLidarDriver/",         "/RearLidarDriver/",         "/PointsTransformerFront/",
      "/PointsTransformerRear/",    "/PointCloudFusion/",        "/RayGroundFilter/",
      "/EuclideanClusterDetector/", "/ObjectCollisionEstimator/"};
  std::map<std::uint64_t, double> roots;  // chain instance → start
  std::vector<double> latencies_ms, planner_starts_ms;
  double drops = 0;
  const auto is_of = [](const std::string& name, const std::string& node) {
    return name.starts_with(node) && name.find("EuclideanClusterSettings") == name.npos;
  };
  for (const json& event : timeline.at("traceEvents")) {
    const std::string name = event.at("name");
    if (event.at("ph") == "i" &&
        std::any_of(hot_path.begin(), hot_path.end(),
                    [&](const std::string& node) { return is_of(name, node); })) {
      drops += std::stod(name.substr(name.rfind(' ')));
    }
    if (event.at("ph") != "X") continue;
    const double start_ms = event.at("ts").get<double>() / 1e3;
    const std::uint64_t chain = event.at("args").at("chain_instance");
    if (is_of(name, hot_path[0]) || is_of(name, hot_path[1])) roots[chain] = start_ms;
    if (is_of(name, hot_path.back())) {
      if (const auto root = roots.find(chain); root != roots.end()) {
        latencies_ms.push_back(start_ms - root->second);
      }
    }
    if (name.starts_with("/BehaviorPlanner/") && event.at("cat") == "timer") {
      planner_starts_ms.push_back(start_ms);
    }
  }
  Histogram from_release;
  for (const json& chain : run.at("chains")) {
    if (chain.at("name") == "hot_path_front") {
      from_release.merge(read_histogram(chain.at("latency_us")));
    }
  }
  double jitter_ms = 0;
  for (std::size_t i = 1; i < planner_starts_ms.size(); ++i) {
    jitter_ms += std::abs(planner_starts_ms[i] - planner_starts_ms[i - 1] - 100) /
                 static_cast<double>(planner_starts_ms.size() - 1);
  }
  return {{"hot_path_release_ms", rt::us(from_release.percentile(0.5)) / 1e3},
          {"hot_path_release_max_ms", rt::us(from_release.max()) / 1e3},
          {"hot_path_ms", rt::median(latencies_ms)},
          {"hot_path_max_ms",
           latencies_ms.empty() ? 0 : *std::max_element(latencies_ms.begin(), latencies_ms.end())},
          {"hot_path_drops", drops},
          {"planner_jitter_ms", jitter_ms}};
}

}  // namespace takt::tools
