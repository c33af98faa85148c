// What the executors of a system leave each other of the CPUs that they share.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_SUPPLIES_HPP_
#define TAKT_ANALYSIS_SUPPLIES_HPP_

#include <vector>

#include "takt/analysis/method.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_INTERNAL analysis {

/// Gives each part its supply, and the parts that are above it. They refer to the parts, which must
/// stay where they are.
void make_supplies(std::vector<Part>& parts);

/// Finds out how long each thread that shares CPUs is busy without a break at most, as far as
/// arrivals are known by now.
void find_busy(std::vector<Part>& parts);

/// Finds out which real-time threads may want more than Linux grants, as far as their arrivals are
/// known by now: more jitter throttles more.
void find_throttled(std::vector<Part>& parts);

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_SUPPLIES_HPP_
