// Latencies by the time at which callbacks started.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_LATENCY_SLICES_HPP_
#define TAKT_EXECUTORS_LATENCY_SLICES_HPP_

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Buckets of a histogram for each of 64 equal slices of a measured time. The threads that run
/// callbacks count by themselves, so no other thread has to wake up to sample over time.
/// Thread safety: from any thread.
/// Real-time: `record` is an atomic addition; nothing allocates.
class LatencySlices {
 public:
  static constexpr std::size_t kSlices = 64;

  /// Each slice lasts `length`, above 0. 300 kB, of which only the pages that are written use
  /// memory.
  explicit LatencySlices(Nanoseconds length) noexcept : length_(length) {}

  /// The first slice begins; before that nothing is counted.
  void begin(TimePoint time) noexcept { begin_.store(time); }
  /// A callback started at `start`. What is later than the last slice counts there.
  void record(TimePoint start, Nanoseconds latency) noexcept {
    const TimePoint begin = begin_.load(std::memory_order_relaxed);
    if (start < begin) return;
    const auto slice = std::min(static_cast<std::size_t>((start - begin) / length_), kSlices - 1);
    counts_[slice][Histogram::bucket_of(latency)].fetch_add(1, std::memory_order_relaxed);
  }

  Nanoseconds length() const noexcept { return length_; }
  /// Its minimum, maximum and sum are computed from the limits of its buckets.
  Histogram slice(std::size_t index) const noexcept {
    Histogram histogram;
    for (std::size_t bucket = 0; bucket < Histogram::kBuckets; ++bucket) {
      const std::uint32_t count = counts_[index][bucket].load(std::memory_order_relaxed);
      if (count != 0) histogram.add_bucket(bucket, count);
    }
    return histogram;
  }

 private:
  const Nanoseconds length_;
  std::atomic<TimePoint> begin_{kNever};
  std::array<std::array<std::atomic<std::uint32_t>, Histogram::kBuckets>, kSlices> counts_{};
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_LATENCY_SLICES_HPP_
