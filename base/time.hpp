// Time as every other part of Takt writes it: nanoseconds on the monotonic clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TIME_HPP_
#define TAKT_BASE_TIME_HPP_

#include <algorithm>
#include <chrono>
#include <string>

namespace takt {

using Nanoseconds = std::chrono::nanoseconds;
/// A point on a monotonic time line; CLOCK_MONOTONIC unless the clock that made it says otherwise.
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

/// In the largest unit in which it is a whole number, as configuration files write it: "1500us".
std::string to_string(Nanoseconds duration);

}  // namespace takt

#endif  // TAKT_BASE_TIME_HPP_
