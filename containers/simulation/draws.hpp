// Random numbers and times of a simulation.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_
#define TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_

#include <cstdint>
#include <random>
#include <utility>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/model/measured_model.hpp"

namespace TAKT_INTERNAL takt {

/// Pseudo-random numbers and times: the same for a seed on every machine.
/// Thread safety: none. Real-time: no.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}
  std::int64_t below(std::int64_t count) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(count));
  }
  Nanoseconds between(Nanoseconds least, Nanoseconds longest) {
    return least + Nanoseconds(below((longest - least).count() + 1));
  }
  /// Draws by the measured distribution: uniformly between adjacent known percentiles.
  Nanoseconds one_of(const MeasuredTimes& times) {
    const std::int64_t percent = below(100);
    Nanoseconds from = times.least;
    for (const auto& [upper, time] :
         {std::pair{10, times.p10}, {50, times.median}, {90, times.p90}, {99, times.p99}}) {
      if (time == Nanoseconds::zero()) continue;
      if (percent < upper) return between(from, time);
      from = time;
    }
    return between(from, times.longest);
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_
