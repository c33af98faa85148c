// SPDX-License-Identifier: Apache-2.0
#include "takt/components/recorded_qos.hpp"

#include <fmt/format.h>

namespace takt {
namespace {

// For bursts of a recording, and for late subscriptions.
constexpr std::size_t kDepth = 1000;

// rmw's numbers, and its words, which later versions write.
constexpr int kReliable = 1, kBestEffort = 2, kTransientLocal = 1, kVolatile = 2;

std::string duration(Nanoseconds value) {
  const bool is_unlimited = value == Nanoseconds::zero();
  const std::int64_t ns = is_unlimited ? INT64_MAX : value.count();
  return fmt::format("\n    sec: {}\n    nsec: {}", ns / 1'000'000'000, ns % 1'000'000'000);
}

// The value of the first "key: value".
std::string value_of(const std::string& text, const std::string& key) {
  const std::size_t found = text.find(key + ":");
  if (found == std::string::npos) return {};
  const std::size_t begin = text.find_first_not_of(' ', found + key.size() + 1);
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_first_of("\r\n", begin) - begin);
}

}  // namespace

std::string to_recorded_qos(const QoS& qos) {
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: {}\n  durability: {}\n  deadline:{}\n"
      "  lifespan:{}\n  liveliness: {}\n  liveliness_lease_duration:{}\n"
      "  avoid_ros_namespace_conventions: false\n",
      qos.depth, qos.reliability == Reliability::reliable ? kReliable : kBestEffort,
      qos.durability == Durability::transient_local ? kTransientLocal : kVolatile,
      duration(qos.deadline_period), duration(qos.lifespan_duration),
      qos.liveliness_kind == Liveliness::automatic ? 1 : 3, duration(qos.lease_duration));
}

QoS from_recorded_qos(const std::string& text) {
  QoS qos(kDepth);
  const std::string reliability = value_of(text, "reliability");
  if (reliability == std::to_string(kBestEffort) || reliability == "best_effort") {
    qos.best_effort();
  }
  const std::string durability = value_of(text, "durability");
  if (durability == std::to_string(kTransientLocal) || durability == "transient_local") {
    qos.transient_local();
  }
  return qos;
}

}  // namespace takt
