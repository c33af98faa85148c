// SPDX-License-Identifier: Apache-2.0
#include "takt/base/time.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

struct Unit {
  std::string_view name;
  double nanoseconds;
};
constexpr std::array<Unit, 6> kUnits{
    {{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}, {"m", 60e9}, {"h", 3600e9}}};

[[noreturn]] void refuse(std::string_view text, std::string_view why) {
  throw Error(fmt::format("'{}' {}", text, why),
              "write a number and one of ns, us, ms, s, m, h, such as 20ms");
}

}  // namespace

std::string to_string(Nanoseconds duration) {
  static constexpr std::array<std::pair<std::int64_t, const char*>, 3> kWritten{
      {{1'000'000'000, "s"}, {1'000'000, "ms"}, {1'000, "us"}}};
  for (const auto& [nanoseconds, name] : kWritten) {
    if (duration.count() % nanoseconds == 0) {
      return std::to_string(duration.count() / nanoseconds) + name;
    }
  }
  // Longer numbers of ns nobody can read: "9.799999ms". Above, a fraction loses some of them.
  constexpr std::int64_t kFewNs = 10'000, kExact = std::int64_t{1} << 50;
  for (const auto& [nanoseconds, name] : kWritten) {
    if (duration.count() < std::max(nanoseconds, kFewNs) || duration.count() > kExact) continue;
    return fmt::format(
        "{}{}", static_cast<double>(duration.count()) / static_cast<double>(nanoseconds), name);
  }
  return std::to_string(duration.count()) + "ns";
}

Nanoseconds parse_duration(std::string_view text) {
  double number = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  // from_chars also accepts a sign, "inf" and "nan".
  if (error != std::errc{} || std::isdigit(static_cast<unsigned char>(text[0])) == 0) {
    refuse(text, "is not a duration");
  }
  const std::string_view unit_name = text.substr(static_cast<std::size_t>(end - text.data()));
  if (unit_name.empty()) refuse(text, "has no unit");
  const auto* const unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& candidate) {
    return candidate.name == unit_name;
  });
  if (unit == kUnits.end()) refuse(text, fmt::format("has the unknown unit '{}'", unit_name));
  const double nanoseconds = number * unit->nanoseconds;
  constexpr double kTooLong = 9.2e18;  // just below what Nanoseconds can hold, 292 years
  if (nanoseconds > kTooLong) refuse(text, "is longer than 292 years, the maximum");
  return Nanoseconds(std::llround(nanoseconds));
}

Nanoseconds parse_run_time(std::string_view text) {
  const Nanoseconds time = parse_duration(text);
  if (time == Nanoseconds::zero()) refuse(text, "is no time at all");
  return time;
}

}  // namespace takt
