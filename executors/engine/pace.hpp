// Limits how often a busy loop does something.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_PACE_HPP_
#define TAKT_EXECUTORS_ENGINE_PACE_HPP_

#include <algorithm>
#include <cstdint>

#include "takt/base/clock.hpp"

namespace takt::detail {

/// Shows a fast loop that about one interval has passed, with few clock readings: one in a tenth of
/// the interval, or one in 64 rounds when these are very short. When short rounds suddenly become
/// long, up to 64 of them may pass first.
/// Thread safety: none.
/// Real-time: a decrement, and now and then a reading of the clock.
class Pace {
 public:
  explicit Pace(Nanoseconds interval) noexcept : interval_(interval) {}

  bool is_due(const Clock& clock) noexcept {
    if (--rounds_until_reading_ != 0) return false;
    const TimePoint now = clock.now();
    const std::int64_t elapsed_ns = std::max<std::int64_t>((now - last_reading_).count(), 1);
    rounds_between_readings_ = static_cast<std::uint32_t>(std::clamp<std::int64_t>(
        rounds_between_readings_ * (interval_.count() / 10) / elapsed_ns, 1, kMostRounds));
    rounds_until_reading_ = rounds_between_readings_;
    last_reading_ = now;
    if (now - last_due_ < interval_) return false;
    last_due_ = now;
    return true;
  }

 private:
  static constexpr std::int64_t kMostRounds = 64;
  const Nanoseconds interval_;
  std::uint32_t rounds_until_reading_ = 1, rounds_between_readings_ = 1;
  TimePoint last_reading_{}, last_due_{};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_PACE_HPP_
