// The parameters that differ between the runs of a simulation.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SCENARIO_HPP_
#define TAKT_CONTAINERS_SIMULATION_SCENARIO_HPP_

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/simulation/fault.hpp"

namespace TAKT_INTERNAL takt {

/// The parameters of a run, drawn or given: a system behaves the same for the same scenario.
struct Scenario {
  enum class Times { worst, drawn };  // of executions: the longest, or any
  static constexpr const char* kAll = "all";

  std::uint64_t seed = 1;
  Times times = Times::worst;
  /// The phases of first releases and first arrivals, by the name of the callback, or kAll for
  /// those that are not named. The seed draws phases that are not given.
  std::map<std::string, Nanoseconds> phases = {{kAll, Nanoseconds::zero()}};
  std::vector<Fault> faults = {};
};

/// A word for a command line: "7,worst,all=0s,/camera/image_timer=3ms,lost=/planner/image@2s".
/// Thread safety: any thread. Real-time: no.
std::string to_string(const Scenario& scenario);
/// Throws Error for a word that is no scenario.
/// Thread safety: any thread. Real-time: no.
Scenario parse_scenario(std::string_view word);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SCENARIO_HPP_
