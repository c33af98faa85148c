// SPDX-License-Identifier: Apache-2.0
#include "takt/base/histogram.hpp"

#include <cmath>
#include <numeric>

namespace takt {

namespace {

// Untrusted input: counts of another process may be any number, so the sum saturates.
std::int64_t with(std::int64_t sum_ns, std::int64_t ns, std::uint64_t count) noexcept {
  std::int64_t more_ns = 0;
  if (__builtin_mul_overflow(ns, count, &more_ns) ||
      __builtin_add_overflow(sum_ns, more_ns, &sum_ns))
    return INT64_MAX;
  return sum_ns;
}

}  // namespace

void Histogram::merge(const Histogram& other) noexcept {
  for (std::size_t i = 0; i < kBuckets; ++i) add(i, other.counts_[i]);
  count_ += other.count_;
  sum_ns_ = with(sum_ns_.own(), other.sum_ns_, 1);
  min_ns_ = std::min(min_ns_.own(), other.min_ns_.load());
  max_ns_ = std::max(max_ns_.own(), other.max_ns_.load());
}

void Histogram::add_bucket(std::size_t bucket, std::uint64_t count) noexcept {
  if (count == 0 || bucket >= kBuckets) return;
  const std::int64_t ns = upper_limit(bucket).count();
  add(bucket, count);
  count_ += count;
  sum_ns_ = with(sum_ns_.own(), ns, count);
  min_ns_ = std::min(min_ns_.own(), ns);
  max_ns_ = std::max(max_ns_.own(), ns);
}

Nanoseconds Histogram::mean() const noexcept {
  const auto count = static_cast<std::int64_t>(count_.load());
  return Nanoseconds(count == 0 ? 0 : sum_ns_ / count);
}

Nanoseconds Histogram::percentile(double fraction) const noexcept {
  const auto held =
      static_cast<double>(std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}));
  if (held == 0) return Nanoseconds::zero();
  const auto wanted = static_cast<std::uint64_t>(std::clamp(std::ceil(fraction * held), 1.0, held));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += counts_[i];
    if (seen >= wanted) return std::clamp(upper_limit(i), min(), max());
  }
  return max();
}

bool Histogram::is_saturated() const noexcept {
  return std::find(counts_.begin(), counts_.end(), kFull) != counts_.end();
}

Nanoseconds Histogram::upper_limit(std::size_t bucket) noexcept {
  if (bucket < (std::size_t{1} << kSubBits)) return Nanoseconds(static_cast<std::int64_t>(bucket));
  const std::size_t shift = (bucket >> kSubBits) - 1;
  const std::size_t lower = ((bucket & ((1u << kSubBits) - 1)) + (1u << kSubBits)) << shift;
  return Nanoseconds(static_cast<std::int64_t>(lower + (std::size_t{1} << shift) - 1));
}

}  // namespace takt
