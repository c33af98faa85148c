// What a simulation draws.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_
#define TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_

#include <cstdint>
#include <random>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Numbers from 0 to below `count`, the same on every machine.
/// Thread safety: none. Real-time: no.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}
  std::int64_t below(std::int64_t count) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(count));
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_DRAWS_HPP_
