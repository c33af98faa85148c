// Which scenarios of a system make its chains late.
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

/// Looks for the longest latency of each chain. First all is released at once. Then, in turn:
///
/// 1. Just missed: one callback is released just after all others, which are served before it; or
///    just before them, so that it has begun when they come.
/// 2. Any phases, with execution times that are the longest, or drawn: half of all runs. Some worst
///    cases are coincidences, to which nothing that climbs is led.
/// 3. Climbing: the worst scenario of a chain, with another phase of one callback. It is any, or
///    near the one that it had; or a release of it comes when the longest instance of the chain was
///    released, or when a callback of that began or ended, or before.
///
/// What comes next depends on the seed and on what runs have shown, and on nothing else.
/// Thread safety: none. Real-time: no.
class ScenarioSearch {
 public:
  explicit ScenarioSearch(std::uint64_t seed) : seed_(seed), draws_(seed) {}

  Scenario next();
  /// What next() has led to.
  void add(const SimulatedRun& run, Nanoseconds time_to_begin);

  struct Worst {
    std::string chain;
    Nanoseconds deadline{0};  // 0: none
    Nanoseconds latency{0};   // 0: it had no instances
    Scenario scenario;
  };
  /// By chain, as in results.
  const std::vector<Worst>& worst() const noexcept { return worst_; }
  /// In worst(): the chain that came closest to its deadline, or was later than others without;
  /// nullopt: there are no chains.
  std::optional<std::size_t> closest_to_deadline() const;

 private:
  /// A scenario from which the climbing goes on.
  struct Place {
    Scenario scenario;
    std::vector<Nanoseconds> phases;   // of all that is released
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
  std::vector<Place> places_;  // as worst_
  Nanoseconds just_{1};
  std::uint64_t runs_ = 0, climbs_ = 0;
  std::size_t missed_ = 0;  // so many of 1.
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SCENARIO_SEARCH_HPP_
