// Durations as people write them: "800us".
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_

#include <string_view>

#include "takt/base/time.hpp"

namespace takt {

/// A number and its unit (ns, us, ms, s, m or h), without a blank: "20ms", "1.5s".
/// Throws an Error that lists the units when there is none.
Nanoseconds parse_duration(std::string_view text);
/// The same for how long something runs: zero is refused.
Nanoseconds parse_run_time(std::string_view text);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_DURATION_HPP_
