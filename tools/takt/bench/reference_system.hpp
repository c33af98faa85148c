// The figures of the Autoware reference system (ros-realtime/reference-system).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_REFERENCE_SYSTEM_HPP_
#define TAKT_TOOLS_TAKT_REFERENCE_SYSTEM_HPP_

#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/measuring/run.hpp"

namespace takt::tools {

/// From a run and its timeline:
/// - hot_path_release_ms, hot_path_release_max_ms: from when the front lidar's timer is due to the
///   end of the collision estimator that its points have reached, by the chain of that name
/// - what upstream shows, from the samples that reach the vehicle's command node:
///   hot_path_samples; hot_path_ms (mean) and hot_path_max_ms, from the start of the later lidar's
///   timer to the start of the collision estimator; hot_path_drops, added up; and
///   planner_deviation_ms, the standard deviation of the planner's period
/// As upstream, it skips the first nine samples that reach either command node. What has no sample
/// is not in the result.
std::map<std::string, double> reference_figures(const rt::Run& run, const nlohmann::json& timeline);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_REFERENCE_SYSTEM_HPP_
