// SPDX-License-Identifier: Apache-2.0
#include "takt/base/trace_clock.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"

namespace takt {
namespace {

constexpr std::pair<const char*, clockid_t> kTraceClocks[] = {{"monotonic", CLOCK_MONOTONIC},
                                                              {"boottime", CLOCK_BOOTTIME},
                                                              {"realtime", CLOCK_REALTIME},
                                                              {"mono_raw", CLOCK_MONOTONIC_RAW}};

Nanoseconds reading_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + Nanoseconds(time.tv_nsec);
}

}  // namespace

std::vector<std::string> TraceClock::names() {
  std::vector<std::string> result;
  for (const auto& [name, clock] : kTraceClocks) result.emplace_back(name);
  return result;
}

TraceClock::TraceClock(const std::string& name) {
  const auto found = std::find_if(std::begin(kTraceClocks), std::end(kTraceClocks),
                                  [&](const auto& known) { return known.first == name; });
  if (found == std::end(kTraceClocks)) {
    throw Error(fmt::format("'{}' is not a clock of traces", printable(name)),
                fmt::format("valid: {}", fmt::join(names(), ", ")));
  }
  clock_ = found->second;
}

// Takes the reading that took the least time: during the others, the thread was interrupted.
Nanoseconds TraceClock::offset() const {
  if (clock_ == CLOCK_MONOTONIC) return Nanoseconds::zero();
  Nanoseconds best = Nanoseconds::max(), result{0};
  for (int i = 0; i < 20; ++i) {
    const Nanoseconds before = reading_of(CLOCK_MONOTONIC);
    const Nanoseconds other = reading_of(clock_);
    const Nanoseconds width = reading_of(CLOCK_MONOTONIC) - before;
    if (width >= best) continue;
    best = width;
    result = other - (before + width / 2);
  }
  return result;
}

}  // namespace takt
