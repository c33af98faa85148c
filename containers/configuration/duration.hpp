// Reads durations with a unit: "800us".
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_

#include <string_view>

#include "takt/base/time.hpp"

namespace takt {

/// Reads a number directly followed by its unit (ns, us, ms, s, m or h): "20ms", "1.5s".
/// Throws Error if the unit is missing; the error lists the units.
Nanoseconds parse_duration(std::string_view text);
/// As parse_duration, but throws Error for zero: the duration of a run or a measurement.
Nanoseconds parse_run_time(std::string_view text);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_
