// The first releases of timers, and the first arrivals, in a scenario.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_FIRST_RELEASES_HPP_
#define TAKT_CONTAINERS_SIMULATION_FIRST_RELEASES_HPP_

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/containers/simulation/simulation.hpp"

namespace takt {

/// The time of the clock when a simulation begins.
inline constexpr TimePoint kSimulationBegin{std::chrono::seconds(1)};

/// Thread safety: none. Real-time: no.
class FirstReleases {
 public:
  FirstReleases(const Scenario& scenario, Nanoseconds duration)
      : scenario_(scenario), duration_(duration), draws_(2 * scenario.seed + 1) {}

  TimePoint of(const std::string& callback, Nanoseconds distance) {
    distance = std::min(distance, duration_);
    // Always drawn, so that the phases of other callbacks do not depend on the given ones.
    Nanoseconds phase(draws_.below(std::max<std::int64_t>(1, distance.count())));
    for (const std::string& name : {callback, std::string(Scenario::kAll)}) {
      const auto given = scenario_.phases.find(name);
      if (given == scenario_.phases.end()) continue;
      phase = given->second;
      break;
    }
    releases_.push_back({callback, phase, distance});
    return later(kSimulationBegin, phase + Nanoseconds(1));
  }

  /// All first releases. Throws Error if the scenario names anything else.
  std::vector<SimulatedRun::Release> all() const {
    std::vector<std::string> names{Scenario::kAll};
    for (const SimulatedRun::Release& release : releases_) names.push_back(release.callback);
    for (const auto& [name, phase] : scenario_.phases) {
      if (std::find(names.begin(), names.end(), name) != names.end()) continue;
      throw Error(fmt::format("the scenario has a phase of '{}', which is no timer that runs, and "
                              "nothing that arrives from outside",
                              name),
                  suggest(name, names));
    }
    return releases_;
  }

 private:
  const Scenario& scenario_;
  const Nanoseconds duration_;
  Draws draws_;
  std::vector<SimulatedRun::Release> releases_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_FIRST_RELEASES_HPP_
