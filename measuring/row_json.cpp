// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/row_json.hpp"

#include <cmath>

namespace takt::rt {

json histogram_json(const Histogram& histogram, bool with_buckets) {
  const auto us = [&](Nanoseconds value) {
    return histogram.count() == 0 ? json() : json(rt::us(value));
  };
  json result = {{"count", histogram.count()},
                 {"sum", us(histogram.sum())},
                 {"mean", us(histogram.mean())},
                 {"min", us(histogram.min())},
                 {"p50", us(histogram.percentile(0.5))},
                 {"p90", us(histogram.percentile(0.9))},
                 {"p99", us(histogram.percentile(0.99))},
                 {"p999", us(histogram.percentile(0.999))},
                 {"max", us(histogram.max())}};
  if (histogram.is_saturated()) result["saturated"] = true;
  if (with_buckets) {
    json buckets = json::array();
    histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
      buckets.push_back({bucket, count});
    });
    result["histogram"] = std::move(buckets);
  }
  return result;
}

std::string Place::text() const {
  if (of == nullptr) return std::string(key);
  return of->text() + (key.empty() ? fmt::format("[{}]", index) : fmt::format(".{}", key));
}

void refuse(const Place& place, const json& value, std::string_view needed) {
  std::string shown = json_text(value);
  if (shown.size() > 40) shown = std::string("of type ") + value.type_name();
  throw Error(fmt::format("{} is {}, and must be {}", place.text(), shown, needed),
              "measure again, or give another file");
}

void refuse_without(const Place& place, const char* key) {
  throw Error(fmt::format("{} has no '{}'", place.text(), key),
              "measure again, or give another file");
}

void read_histogram(const json& from, Histogram& into, const Place& place) {
  if (!from.is_object()) refuse(place, from, "a distribution");
  std::uint64_t samples = 0;
  Nanoseconds min{0}, max{0}, sum{0};
  read_key(from, "count", samples, place);
  const auto time = [&](const char* key, Nanoseconds& of) {
    if (samples != 0) read_key(from, key, of, place);
  };
  time("min", min);
  time("max", max);
  if (min > max) refuse({&place, "min"}, from.at("min"), "at most 'max', " + from.at("max").dump());
  if (!from.contains("histogram")) return;
  time("sum", sum);
  std::vector<std::vector<std::uint64_t>> buckets;
  read_key(from, "histogram", buckets, place);
  for (const auto& bucket : buckets) {
    if (bucket.size() != 2 || bucket[0] >= Histogram::kBuckets) {
      refuse({&place, "histogram"}, bucket,
             fmt::format("[bucket, count] with a bucket of 0 to {}", Histogram::kBuckets - 1));
    }
    into.add_bucket(bucket[0], bucket[1]);
  }
  if (into.count() != 0) into.set_exact(samples, min, max, sum);
}

Nanoseconds from_us(const json& us) {
  return Nanoseconds(std::llround(us.get<double>() * 1e3));
}

}  // namespace takt::rt
