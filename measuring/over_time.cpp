// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/over_time.hpp"

#include "takt/measuring/rounds.hpp"

namespace takt::rt {

void OverTime::make_room(Nanoseconds until) {
  while (length_ * kSlices < until) {
    for (std::size_t i = 0; i < kSlices; ++i) {
      Histogram merged;
      if (2 * i < kSlices) {
        merged = slices_[2 * i];
        merged.merge(slices_[2 * i + 1]);
      }
      slices_[i] = merged;
    }
    length_ *= 2;
  }
}

void OverTime::add(Nanoseconds since_beginning, const Histogram& latencies) {
  make_room(since_beginning + Nanoseconds(1));
  slices_[static_cast<std::size_t>(since_beginning / length_)].merge(latencies);
}

nlohmann::json over_time_json(const OverTime& over_time) {
  const double slice_s = us(over_time.slice_length()) / 1e6;
  nlohmann::json slices = nlohmann::json::array();
  for (std::size_t i = 0; i < over_time.slices().size(); ++i) {
    const Histogram& slice = over_time.slices()[i];
    if (slice.count() == 0) continue;
    slices.push_back({{"begin_s", slice_s * static_cast<double>(i)},
                      {"count", slice.count()},
                      {"min_us", us(slice.min())},
                      {"p50_us", us(slice.percentile(0.5))},
                      {"p99_us", us(slice.percentile(0.99))},
                      {"max_us", us(slice.max())}});
  }
  return {{"slice_s", slice_s}, {"slices", std::move(slices)}};
}

}  // namespace takt::rt
