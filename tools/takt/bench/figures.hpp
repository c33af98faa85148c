// Computes the metrics of takt bench.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_FIGURES_HPP_
#define TAKT_TOOLS_TAKT_FIGURES_HPP_

#include <cstdint>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/base/histogram.hpp"

#include "bench/experiments.hpp"

namespace takt::tools {

/// The metrics of one run, and its histogram.
struct Figures {
  std::map<std::string, double> values;
  Histogram latency;
};

Figures figures_of(const nlohmann::json& run, const Variant& variant);

/// The key figures of ros-realtime/reference-system, computed from a timeline:
/// - hot path: latency from the start of a lidar's timer to the start of the collision estimator
/// for the same chain instance, and the messages overwritten on the path
/// - planner: mean deviation of its period from 100 ms
std::map<std::string, double> key_figures(const nlohmann::json& timeline);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FIGURES_HPP_
