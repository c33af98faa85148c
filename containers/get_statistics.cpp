// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/get_statistics.hpp"

#include <algorithm>
#include <cstddef>
#include <map>

namespace takt {

GetStatistics::Times GetStatistics::Times::of(const Histogram& histogram) {
  Times times{.count = histogram.count(),
              .sum_ns = histogram.sum().count(),
              .min_ns = histogram.min().count(),
              .max_ns = histogram.max().count()};
  histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t held) {
    times.buckets.push_back(static_cast<std::uint16_t>(bucket));
    times.counts.push_back(static_cast<std::uint32_t>(held));
  });
  return times;
}

Histogram GetStatistics::Times::since(const Times& before) const {
  std::map<std::uint16_t, std::uint32_t> earlier;
  for (std::size_t i = 0; i < std::min(before.buckets.size(), before.counts.size()); ++i) {
    earlier[before.buckets[i]] = before.counts[i];
  }
  Histogram part;
  for (std::size_t i = 0; i < std::min(buckets.size(), counts.size()); ++i) {
    const auto known = earlier.find(buckets[i]);
    const std::uint32_t counted = known != earlier.end() ? known->second : 0;
    part.add_bucket(buckets[i], counts[i] - std::min(counts[i], counted));
  }
  return part;
}

}  // namespace takt
