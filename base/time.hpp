// Time as every other part of Takt writes it: nanoseconds on the monotonic clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TIME_HPP_
#define TAKT_BASE_TIME_HPP_

#include <chrono>
#include <string>

namespace takt {

using Nanoseconds = std::chrono::nanoseconds;
/// A point on a monotonic time line; CLOCK_MONOTONIC unless the clock that made it says otherwise.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Nanoseconds>;

/// "Never": a wait until here only ends by a wake-up.
inline constexpr TimePoint kNever = TimePoint::max();

/// In the largest unit in which it is a whole number, as configuration files write it: "1500us".
std::string to_string(Nanoseconds duration);

}  // namespace takt

#endif  // TAKT_BASE_TIME_HPP_
