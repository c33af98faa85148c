// ROS time: points in time that other machines understand.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_ROS_TIME_HPP_
#define TAKT_BASE_ROS_TIME_HPP_

#include <chrono>
#include <compare>
#include <cstdint>
#include <limits>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace builtin_interfaces::msg {
template <class Allocator>
struct Time_;  // Takt's and ROS 2's headers both define it so
}  // namespace builtin_interfaces::msg

namespace TAKT_PUBLIC takt {

namespace detail {

/// A stamp or a duration as messages have it: seconds, which are the floor, and what is left. What
/// does not fit, from the year 2038 on, becomes the nearest that does.
template <class Stamp>
constexpr Stamp stamp_of(Nanoseconds time) noexcept {
  using Limits = std::numeric_limits<std::int32_t>;
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  Stamp stamp;
  if (seconds.count() > Limits::max()) {
    stamp.sec = Limits::max();
    stamp.nanosec = 999'999'999;
  } else if (seconds.count() < Limits::min()) {
    stamp.sec = Limits::min();
    stamp.nanosec = 0;
  } else {
    stamp.sec = static_cast<std::int32_t>(seconds.count());
    stamp.nanosec = static_cast<std::uint32_t>((time - seconds).count());
  }
  return stamp;
}

}  // namespace detail

/// What stamps of messages say: the time since 1970, or since whatever a simulator counts from. A
/// TimePoint counts from the start of this machine, so it is no stamp. It becomes a
/// `builtin_interfaces::msg::Time`, and is made from one.
/// Thread safety: a value.
/// Real-time: yes.
class Time {
 public:
  constexpr Time() noexcept = default;
  constexpr explicit Time(Nanoseconds since_epoch) noexcept : since_epoch_(since_epoch) {}
  constexpr Time(std::chrono::system_clock::time_point time) noexcept
      : since_epoch_(time.time_since_epoch()) {}
  template <class Allocator>
  constexpr Time(const builtin_interfaces::msg::Time_<Allocator>& stamp) noexcept
      : since_epoch_(std::chrono::seconds(stamp.sec) + Nanoseconds(stamp.nanosec)) {}

  template <class Allocator>
  operator builtin_interfaces::msg::Time_<Allocator>() const {
    return detail::stamp_of<builtin_interfaces::msg::Time_<Allocator>>(since_epoch_);
  }

  constexpr std::int64_t nanoseconds() const noexcept { return since_epoch_.count(); }
  constexpr double seconds() const noexcept {
    return std::chrono::duration<double>(since_epoch_).count();
  }

  friend constexpr auto operator<=>(const Time&, const Time&) noexcept = default;
  friend constexpr bool operator==(const Time&, const Time&) noexcept = default;
  template <class Allocator>  // as each could become the other
  friend constexpr bool operator==(
      const Time& time, const builtin_interfaces::msg::Time_<Allocator>& stamp) noexcept {
    return time == Time(stamp);
  }
  friend constexpr Nanoseconds operator-(const Time& a, const Time& b) noexcept {
    return between(TimePoint(b.since_epoch_), TimePoint(a.since_epoch_));
  }
  friend constexpr Time operator+(const Time& time, Nanoseconds duration) noexcept {
    return Time(later(TimePoint(time.since_epoch_), duration).time_since_epoch());
  }

 private:
  Nanoseconds since_epoch_{};
};

}  // namespace takt

#endif  // TAKT_BASE_ROS_TIME_HPP_
