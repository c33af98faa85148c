// Latencies by time: how a figure goes over the length of a measurement.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_OVER_TIME_HPP_
#define TAKT_MEASURING_OVER_TIME_HPP_

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"

namespace takt::rt {

/// A histogram for each of up to 64 equal slices of time since the beginning. When there are more,
/// two become one, so a run of any length has 32 to 64.
/// Thread safety: one writer at a time; readers only when no writer runs.
/// Real-time: `record` is; it allocates nothing.
class OverTime {
 public:
  static constexpr std::size_t kSlices = 64;
  /// The length of a slice, at first.
  static constexpr Nanoseconds kShortest = std::chrono::milliseconds(1);

  explicit OverTime(Nanoseconds length = kShortest) : length_(length), slices_(kSlices) {}
  /// What is later than this counts in the last slice. Not while a writer runs.
  void make_room(Nanoseconds until);
  void record(Nanoseconds since_beginning, Nanoseconds latency) noexcept {
    const auto slice = static_cast<std::size_t>(since_beginning / length_);
    slices_[slice < kSlices ? slice : kSlices - 1].record(latency);
  }

  /// Makes room first: for what was measured elsewhere.
  void add(Nanoseconds since_beginning, const Histogram& latencies);

  Nanoseconds slice_length() const noexcept { return length_; }
  const std::vector<Histogram>& slices() const noexcept { return slices_; }

 private:
  Nanoseconds length_;
  std::vector<Histogram> slices_;
};

/// {"slice_s", "slices": [{"begin_s", "count", "min_us", "p50_us", "p99_us", "max_us"}]}, without
/// the slices in which nothing was measured.
nlohmann::json over_time_json(const OverTime& over_time);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_OVER_TIME_HPP_
