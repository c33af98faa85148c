// A histogram of durations with fixed buckets.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_HISTOGRAM_HPP_
#define TAKT_BASE_HISTOGRAM_HPP_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "takt/base/counter.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A log-linear histogram: 32 buckets for each power of two, so a percentile is at most 3.2 % too
/// high and never too low, from 1 ns to 2^40 ns (18 minutes). Longer durations count in the last
/// bucket, negative ones in the first. Count, minimum, maximum and mean are exact. A bucket holds
/// 2^32 - 1 samples (days at 10 kHz); one that is full counts no more, see is_saturated().
/// The idea is HdrHistogram's (Gil Tene); no C or C++ edition of it is in Debian 12.
///
/// Thread safety: one writer at a time; readers at any time. Of a copy that is made meanwhile,
/// the minimum and maximum are those of all that its buckets hold, and count and sum may be
/// ahead of these by what is being recorded.
/// Real-time: `record` is a handful of instructions; nothing allocates.
class Histogram {
 public:
  static constexpr unsigned kSubBits = 5;
  // Limit: bits of a time in ns that a histogram tells from others. At it: longer times count in
  // the last bucket; the maximum is exact. Seen: the maximum.
  static constexpr unsigned kMaxBits = 40;
  static constexpr std::size_t kBuckets = (kMaxBits - kSubBits + 1) << kSubBits;
  static constexpr std::uint32_t kFull = UINT32_MAX;

  void record(Nanoseconds value) noexcept {
    const std::int64_t ns = std::max<std::int64_t>(value.count(), 0);
    if (ns < min_ns_.own()) min_ns_ = ns;
    if (ns > max_ns_.own()) max_ns_ = ns;
    sum_ns_ += ns;
    ++count_;
    Counter<std::uint32_t>& bucket = counts_[bucket_of(Nanoseconds(ns))];
    if (bucket.own() != kFull) [[likely]]
      bucket.publish(bucket.own() + 1);  // last, and copied first
  }

  void merge(const Histogram& other) noexcept;
  /// Adds `count` samples of bucket `bucket`, as `for_each_bucket` gave them (reading a result
  /// file back); minimum, maximum and sum are then those of the bucket limits, until set_exact.
  void add_bucket(std::size_t bucket, std::uint64_t count) noexcept;
  void set_exact(std::uint64_t count, Nanoseconds min, Nanoseconds max, Nanoseconds sum) noexcept {
    count_ = count;
    min_ns_ = min.count();
    max_ns_ = max.count();
    sum_ns_ = sum.count();
  }

  std::uint64_t count() const noexcept { return count_; }
  Nanoseconds sum() const noexcept { return Nanoseconds(sum_ns_); }
  Nanoseconds min() const noexcept {
    const std::int64_t ns = min_ns_;
    return Nanoseconds(ns == INT64_MAX ? 0 : ns);
  }
  Nanoseconds max() const noexcept { return Nanoseconds(max_ns_); }
  Nanoseconds mean() const noexcept;
  /// The smallest bucket limit that at least `fraction` (0 to 1) of the samples do not exceed,
  /// but never more than max(). Of a saturated histogram: of the samples that its buckets hold.
  Nanoseconds percentile(double fraction) const noexcept;
  /// Whether a bucket is full: its samples weigh too little in the percentiles from then on.
  bool is_saturated() const noexcept;

  /// Calls `visit(bucket, upper limit, count)` for each bucket that is not empty.
  template <class Visit>
  void for_each_bucket(Visit&& visit) const {
    for (std::size_t i = 0; i < kBuckets; ++i) {
      if (const std::uint64_t count = counts_[i]; count != 0) visit(i, upper_limit(i), count);
    }
  }

  static std::size_t bucket_of(Nanoseconds value) noexcept {
    const auto ns = static_cast<std::uint64_t>(
        std::clamp<std::int64_t>(value.count(), 0, (std::int64_t{1} << kMaxBits) - 1));
    if (ns < (std::uint64_t{1} << kSubBits)) return ns;
    const unsigned shift = static_cast<unsigned>(std::bit_width(ns)) - 1 - kSubBits;
    return (std::size_t{shift + 1} << kSubBits) + ((ns >> shift) - (std::uint64_t{1} << kSubBits));
  }
  /// The largest value that falls into the bucket.
  static Nanoseconds upper_limit(std::size_t bucket) noexcept;

 private:
  void add(std::size_t bucket, std::uint64_t count) noexcept {
    const std::uint64_t room = kFull - counts_[bucket];
    counts_[bucket] += static_cast<std::uint32_t>(std::min(count, room));
  }

  std::array<Counter<std::uint32_t>, kBuckets> counts_{};
  Counter<> count_;
  Counter<std::int64_t> sum_ns_;
  Counter<std::int64_t> min_ns_ = INT64_MAX;
  Counter<std::int64_t> max_ns_;
};

}  // namespace takt

#endif  // TAKT_BASE_HISTOGRAM_HPP_
