// SPDX-License-Identifier: Apache-2.0
#include "run/stored_fault.hpp"

#include <cstdint>
#include <initializer_list>

#include <fmt/format.h>

#include "takt/base/histogram.hpp"
#include "takt/measuring/json_text.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// What is wrong with a histogram whose fields are of the right kinds, else nothing.
std::string fault_of_latency(const json& latency) {
  for (const json& bucket : latency.value("histogram", json::array())) {
    const json &index = bucket.at(0), &count = bucket.at(1);
    if (!index.is_number_unsigned() || index.get<std::uint64_t>() >= Histogram::kBuckets) {
      return fmt::format("a histogram has the bucket {}, of 0 to {}", rt::json_text(index),
                         Histogram::kBuckets - 1);
    }
    if (!count.is_number_unsigned()) {
      return fmt::format("a bucket of a histogram has the count {}", rt::json_text(count));
    }
  }
  const json min = latency.value("min", json()), max = latency.value("max", json());
  if (min.is_number() && max.is_number() && min > max) {
    return fmt::format("a latency has the minimum {} above its maximum {}", rt::json_text(min),
                       rt::json_text(max));
  }
  return "";
}

}  // namespace

std::string stored_fault(const json& run) {
  const double seconds = run.at("duration_s");
  if (!(seconds > 0)) return fmt::format("duration_s is {}, and must be above 0", seconds);
  std::string fault;
  const auto check_counts = [&fault](const json& of, std::initializer_list<const char*> keys) {
    for (const char* const key : keys) {
      if (!fault.empty() || !of.contains(key) || of.at(key).is_number_unsigned()) continue;
      fault = fmt::format("{} is {}, and must be a whole number from 0", key,
                          rt::json_text(of.at(key)));
    }
  };
  check_counts(run, {"repeat"});
  for (const char* const part : {"callbacks", "chains"}) {
    for (const json& each : run.at(part)) {
      check_counts(each, {"received", "deadline_misses", "instances", "misses"});
      check_counts(each.at("latency_us"), {"count"});
      if (fault.empty()) fault = fault_of_latency(each.at("latency_us"));
    }
  }
  for (const json& thread : run.at("threads")) check_counts(thread, {"wakeups"});
  return fault;
}

}  // namespace takt::tools
