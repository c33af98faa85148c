// What the runs of takt bench are worth.
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

/// What one run is worth, by metric, and its histogram.
struct Figures {
  std::map<std::string, double> values;
  Histogram latency;
};

Figures figures_of(const nlohmann::json& run, const Variant& variant);

/// The key figures of ros-realtime/reference-system, from a timeline. Hot path: from the start of a
/// lidar's timer to the start of the collision estimator on what came of it, and what was
/// overwritten on the way. Planner: how far the distance of its cycles is from 100 ms, on the
/// average.
std::map<std::string, double> key_figures(const nlohmann::json& timeline);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FIGURES_HPP_
