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

/// The key figures of ros-realtime/reference-system:
/// - hot path from its release: from when the front lidar's timer is due to the end of the
/// collision
///   estimator that its points have reached, by the chain of that name in the run
/// - hot path as the reference system counts it, from the timeline: from the start of the timer of
///   the lidar whose points came last, to the start of the collision estimator; so neither the wait
///   for the lidar's callback nor the estimator's work is a part of it. And the messages
///   overwritten on the path
/// - planner: mean deviation of its period from 100 ms
std::map<std::string, double> key_figures(const nlohmann::json& run,
                                          const nlohmann::json& timeline);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FIGURES_HPP_
