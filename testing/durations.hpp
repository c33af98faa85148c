// The durations with which every option that is one is tested.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_DURATIONS_HPP_
#define TAKT_TESTING_DURATIONS_HPP_

#include <array>
#include <chrono>

#include "takt/base/time.hpp"

namespace takt {

/// None, the shortest, an ordinary one, a hundred years, and for ever.
inline constexpr std::array<Nanoseconds, 5> kDurations{
    Nanoseconds(0), Nanoseconds(1), std::chrono::seconds(1), std::chrono::hours(24 * 36525),
    Nanoseconds::max()};

}  // namespace takt

#endif  // TAKT_TESTING_DURATIONS_HPP_
