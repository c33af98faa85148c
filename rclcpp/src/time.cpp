// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/time.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "takt/base/ros_time.hpp"

namespace rclcpp {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

std::int64_t sum(std::int64_t a, std::int64_t b) {
  std::int64_t result = 0;
  if (__builtin_add_overflow(a, b, &result)) throw std::overflow_error("sum of times overflows");
  return result;
}
std::int64_t difference(std::int64_t a, std::int64_t b) {
  std::int64_t result = 0;
  if (__builtin_sub_overflow(a, b, &result)) {
    throw std::overflow_error("difference of times overflows");
  }
  return result;
}
void check_kinds(const Time& a, const Time& b) {
  if (a.get_clock_type() != b.get_clock_type()) {
    throw std::runtime_error("can't compare or subtract times with different time sources");
  }
}

}  // namespace

Duration::Duration(std::int32_t seconds, std::uint32_t nanoseconds)
    : ns_(seconds * kSecond + nanoseconds) {
}
Duration::Duration(const builtin_interfaces::msg::Duration& message)
    : Duration(message.sec, message.nanosec) {
}
Duration Duration::from_seconds(double seconds) {
  const double ns = seconds * static_cast<double>(kSecond);
  if (std::isnan(ns)) throw std::runtime_error("a rclcpp::Duration of NaN seconds");
  using Limits = std::numeric_limits<std::int64_t>;
  if (ns >= static_cast<double>(Limits::max())) return from_nanoseconds(Limits::max());
  if (ns <= static_cast<double>(Limits::min())) return from_nanoseconds(Limits::min());
  return from_nanoseconds(static_cast<std::int64_t>(ns));
}
Duration Duration::from_rmw_time(rmw_time_t time) {
  constexpr std::uint64_t kLongest = std::numeric_limits<std::int64_t>::max();
  if (time.sec > kLongest / kSecond) return max();
  const std::uint64_t ns = time.sec * kSecond + time.nsec;
  return ns > kLongest ? max() : from_nanoseconds(static_cast<std::int64_t>(ns));
}
Duration Duration::max() {
  return from_nanoseconds(std::numeric_limits<std::int64_t>::max());
}
Duration::operator builtin_interfaces::msg::Duration() const {
  return takt::detail::stamp_of<builtin_interfaces::msg::Duration>(std::chrono::nanoseconds(ns_));
}
Duration Duration::operator+(const Duration& other) const {
  return from_nanoseconds(sum(ns_, other.ns_));
}
Duration Duration::operator-(const Duration& other) const {
  return from_nanoseconds(difference(ns_, other.ns_));
}
Duration Duration::operator*(double scale) const {
  if (!std::isfinite(scale)) throw std::runtime_error("abnormal scale in rclcpp::Duration");
  const long double product = static_cast<long double>(ns_) * scale;
  constexpr auto kLongest = static_cast<long double>(std::numeric_limits<std::int64_t>::max());
  if (product > kLongest || product < -kLongest) throw std::overflow_error("duration overflows");
  return from_nanoseconds(static_cast<std::int64_t>(product));
}
rmw_time_t Duration::to_rmw_time() const {
  if (ns_ < 0) throw std::runtime_error("rmw_time_t cannot be negative");
  const auto ns = static_cast<std::uint64_t>(ns_);
  return {ns / kSecond, ns % kSecond};
}

Time::Time(std::int32_t seconds, std::uint32_t nanoseconds, rcl_clock_type_t type)
    : ns_(seconds * kSecond + nanoseconds), type_(type) {
  if (seconds < 0) throw std::runtime_error("cannot store a negative time point in rclcpp::Time");
}
Time::Time(const builtin_interfaces::msg::Time& message, rcl_clock_type_t type)
    : Time(message.sec, message.nanosec, type) {
}
Time Time::max(rcl_clock_type_t type) {
  return Time(std::numeric_limits<std::int32_t>::max(), 999'999'999, type);
}
Time::operator builtin_interfaces::msg::Time() const {
  return takt::detail::stamp_of<builtin_interfaces::msg::Time>(std::chrono::nanoseconds(ns_));
}
std::strong_ordering Time::operator<=>(const Time& other) const {
  check_kinds(*this, other);
  return ns_ <=> other.ns_;
}
Time Time::operator+(const Duration& duration) const {
  return Time(sum(ns_, duration.nanoseconds()), type_);
}
Time Time::operator-(const Duration& duration) const {
  return Time(difference(ns_, duration.nanoseconds()), type_);
}
Duration Time::operator-(const Time& other) const {
  check_kinds(*this, other);
  return Duration::from_nanoseconds(difference(ns_, other.ns_));
}

}  // namespace rclcpp
