// The latencies of messages over the time of a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_
#define TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_

#include <memory>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/executors/latency_slices.hpp"

namespace takt::tools {

/// For a run of this length, of which each process has the same; nullptr for 0.
std::shared_ptr<LatencySlices> slices_for(Nanoseconds duration);

/// What one process has counted; null without slices.
nlohmann::json slices_json(const LatencySlices* slices);

/// Of the slices_json() of all processes, as rt::over_time_json(); null if there is none.
nlohmann::json combined_over_time(const std::vector<nlohmann::json>& parts);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_
