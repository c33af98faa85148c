// Time types: nanoseconds on the monotonic clock. Durations as text: "800us".
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TIME_HPP_
#define TAKT_BASE_TIME_HPP_

#include <chrono>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

using Nanoseconds = std::chrono::nanoseconds;
/// A point in time of a Clock, by default of CLOCK_MONOTONIC.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Nanoseconds>;

/// "Never": a wait until here only ends by a wake-up.
inline constexpr TimePoint kNever = TimePoint::max();

/// `time` + `duration`. A sum that no TimePoint can hold is the last one, kNever, or the first one:
/// a duration may be as long as "for ever". `./dev check` refuses the plain sum.
constexpr TimePoint later(TimePoint time, Nanoseconds duration) noexcept {
  Nanoseconds::rep sum = 0;
  if (!__builtin_add_overflow(time.time_since_epoch().count(), duration.count(), &sum)) {
    return TimePoint(Nanoseconds(sum));
  }
  return duration < Nanoseconds::zero() ? TimePoint::min() : kNever;
}
/// `to` - `from`, or the longest duration of that sign.
constexpr Nanoseconds between(TimePoint from, TimePoint to) noexcept {
  Nanoseconds::rep difference = 0;
  if (!__builtin_sub_overflow(to.time_since_epoch().count(), from.time_since_epoch().count(),
                              &difference)) {
    return Nanoseconds(difference);
  }
  return from < to ? Nanoseconds::max() : Nanoseconds::min();
}
/// The end of a time-out that begins at `now`; a negative one never ends.
constexpr TimePoint end_of(Nanoseconds timeout, TimePoint now) noexcept {
  return timeout < Nanoseconds::zero() ? kNever : later(now, timeout);
}

/// Formats a duration as in configuration files, in the largest unit that gives a whole number:
/// "1500us"; if that has many digits, with a fraction: "9.799999ms".
std::string to_string(Nanoseconds duration);
/// Reads a number directly followed by its unit (ns, us, ms, s, m or h): "20ms", "1.5s".
/// Throws Error if the unit is missing; the error lists the units.
Nanoseconds parse_duration(std::string_view text);
/// As parse_duration, but zero is an Error: of a run, of an option.
Nanoseconds parse_run_time(std::string_view text);

}  // namespace takt

#endif  // TAKT_BASE_TIME_HPP_
