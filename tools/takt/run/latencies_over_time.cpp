// SPDX-License-Identifier: Apache-2.0
#include "run/latencies_over_time.hpp"

#include <algorithm>
#include <optional>

#include "takt/measuring/over_time.hpp"

namespace takt::tools {

using nlohmann::json;

std::shared_ptr<LatencySlices> slices_for(Nanoseconds duration) {
  if (duration == Nanoseconds::zero()) return nullptr;
  constexpr Nanoseconds kShortest = std::chrono::milliseconds(125);
  constexpr auto kSlices = static_cast<std::int64_t>(LatencySlices::kSlices);
  return std::make_shared<LatencySlices>(std::max(kShortest, duration / kSlices + Nanoseconds(1)));
}

json slices_json(const LatencySlices* slices) {
  if (slices == nullptr) return {};
  json result = json::array();
  for (std::size_t i = 0; i < LatencySlices::kSlices; ++i) {
    json buckets = json::array();
    slices->slice(i).for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
      buckets.push_back({bucket, count});
    });
    if (!buckets.empty()) result.push_back({{"slice", i}, {"histogram", std::move(buckets)}});
  }
  return {{"length_ns", slices->length().count()}, {"slices", std::move(result)}};
}

json combined_over_time(const std::vector<json>& parts) {
  std::optional<rt::OverTime> all;
  for (const json& part : parts) {
    if (part.is_null()) continue;
    const Nanoseconds length(part.at("length_ns").get<std::int64_t>());
    for (const json& slice : part.at("slices")) {
      if (!all) all.emplace(length);
      Histogram histogram;
      for (const json& bucket : slice.at("histogram")) {
        histogram.add_bucket(bucket.at(0).get<std::size_t>(), bucket.at(1).get<std::uint64_t>());
      }
      all->add(length * slice.at("slice").get<std::int64_t>(), histogram);
    }
  }
  return all ? rt::over_time_json(*all) : json();
}

}  // namespace takt::tools
