// Searches for scenarios that make a system's chains late.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SCENARIO_SEARCH_HPP_
#define TAKT_CONTAINERS_SIMULATION_SCENARIO_SEARCH_HPP_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/containers/simulation/simulation.hpp"

namespace TAKT_INTERNAL takt {

/// Searches for the longest latency of each chain. First, all callbacks are released at once. Then,
/// in turn:
///
/// 1. Just missed: one callback is released just after all others, which are served before it; or
///    just before them, so that it has begun when they come.
/// 2. Random phases, with the longest or drawn execution times: half of all runs. Some worst cases
///    are coincidences that hill climbing does not reach.
/// 3. Hill climbing: the worst scenario of a chain, with another phase of one callback: a random
///    one, one near its old phase, or one with a release when the longest instance of the chain was
///    released, when a callback of this instance began or ended, or before that.
///
/// The search is deterministic: it depends only on the seed and on the results of earlier runs.
/// Thread safety: none. Real-time: no.
class ScenarioSearch {
 public:
  explicit ScenarioSearch(std::uint64_t seed) : seed_(seed), draws_(seed) {}

  Scenario next();
  /// Adds the run of the scenario that next() returned.
  void add(const SimulatedRun& run, Nanoseconds time_to_begin);

  struct Worst {
    std::string chain;
    Nanoseconds deadline{0};  // 0: none
    Nanoseconds latency{0};   // 0: it had no instances
    Scenario scenario;
  };
  /// By chain, as in results.
  const std::vector<Worst>& worst() const noexcept { return worst_; }
  /// The index in worst() of the chain with the largest ratio of latency to deadline, where any
  /// chain without a deadline comes first; nullopt: there are no chains.
  std::optional<std::size_t> closest_to_deadline() const;

 private:
  /// A scenario from which hill climbing continues.
  struct Place {
    Scenario scenario;
    std::vector<Nanoseconds> phases;   // of all releases
    std::vector<Nanoseconds> moments;  // see SimulatedRun
  };

  Scenario just_missed();
  Scenario climb();
  Nanoseconds other_phase(const Place& place, std::size_t of);
  Nanoseconds any_step(Nanoseconds most);

  const std::uint64_t seed_;
  Draws draws_;
  std::vector<SimulatedRun::Release> releases_;
  std::vector<Worst> worst_;
  std::vector<Place> places_;  // indexed as worst_
  Nanoseconds just_{1};
  std::uint64_t runs_ = 0, climbs_ = 0;
  std::size_t missed_ = 0;  // number of runs of step 1
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SCENARIO_SEARCH_HPP_
