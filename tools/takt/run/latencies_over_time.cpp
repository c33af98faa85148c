// SPDX-License-Identifier: Apache-2.0
#include "run/latencies_over_time.hpp"

#include <algorithm>

#include "takt/containers/get_statistics.hpp"

#include "run/result_json.hpp"

namespace takt::tools {

using nlohmann::json;

void LatenciesOverTime::begin() {
  begin_ = last_ = Clock::steady().now();
  before_ = container_.message_latencies();
  due_ = later(begin_, over_time_.slice_length());
}

void LatenciesOverTime::look() {
  const TimePoint now = Clock::steady().now();
  const Histogram all = container_.message_latencies();
  const Histogram part = GetStatistics::Times::of(all).since(GetStatistics::Times::of(before_));
  over_time_.add((last_ + (now - last_) / 2) - begin_, part);
  before_ = all;
  last_ = now;
  const auto passed = (now - begin_) / over_time_.slice_length();
  due_ = later(begin_, over_time_.slice_length() * (passed + 1));
}

json LatenciesOverTime::end() {
  if (due_ == kNever) return {};
  look();
  due_ = kNever;
  json slices = json::array();
  for (std::size_t i = 0; i < over_time_.slices().size(); ++i) {
    json buckets = json::array();
    over_time_.slices()[i].for_each_bucket(
        [&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
          buckets.push_back({bucket, count});
        });
    if (!buckets.empty()) slices.push_back({{"slice", i}, {"histogram", std::move(buckets)}});
  }
  return {{"length_ns", over_time_.slice_length().count()}, {"slices", std::move(slices)}};
}

json combined_over_time(const std::vector<json>& parts) {
  const auto length_of = [](const json& part) {
    return Nanoseconds(part.is_null() ? 0 : part.at("length_ns").get<std::int64_t>());
  };
  Nanoseconds longest{0};  // each is a power of two times the first
  for (const json& part : parts) longest = std::max(longest, length_of(part));
  if (longest == Nanoseconds::zero()) return {};
  rt::OverTime all(longest);
  bool is_any = false;
  for (const json& part : parts) {
    if (part.is_null()) continue;
    const Nanoseconds length = length_of(part);
    for (const json& slice : part.at("slices")) {
      is_any = true;
      Histogram histogram;
      for (const json& bucket : slice.at("histogram")) {
        histogram.add_bucket(bucket.at(0).get<std::size_t>(), bucket.at(1).get<std::uint64_t>());
      }
      all.add(length * slice.at("slice").get<std::int64_t>() + length / 2, histogram);
    }
  }
  return is_any ? rt::over_time_json(all) : json();
}

}  // namespace takt::tools
