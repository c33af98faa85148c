// Time types: nanoseconds on the monotonic clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TIME_HPP_
#define TAKT_BASE_TIME_HPP_

#include <algorithm>
#include <chrono>
#include <string>

namespace takt {

using Nanoseconds = std::chrono::nanoseconds;
/// A point in time of a Clock, by default of CLOCK_MONOTONIC.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Nanoseconds>;

/// "Never": a wait until here only ends by a wake-up.
inline constexpr TimePoint kNever = TimePoint::max();

/// `time` + `duration`, at most kNever: a duration may be as long as "for ever".
constexpr TimePoint later(TimePoint time, Nanoseconds duration) noexcept {
  return duration > kNever - std::max(time, TimePoint{}) ? kNever : time + duration;
}
/// The end of a time-out that begins at `now`; a negative one never ends.
constexpr TimePoint end_of(Nanoseconds timeout, TimePoint now) noexcept {
  return timeout < Nanoseconds::zero() ? kNever : later(now, timeout);
}

/// Formats a duration in the largest unit that gives a whole number, as in configuration files:
/// "1500us".
std::string to_string(Nanoseconds duration);

}  // namespace takt

#endif  // TAKT_BASE_TIME_HPP_
