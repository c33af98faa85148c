// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/qos.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/keep_last_ring.hpp"

namespace takt {
namespace {

// Limit: the `depth` of a history. At it: a larger one is refused. Seen: the error.
constexpr std::size_t kMaxDepth = KeepLastRing<void>::kMaxDepth;

// From rmw/qos_profiles.h of ROS 2. "system_default" there leaves values to DDS; here it is the
// default QoS.
const std::array<std::pair<std::string_view, QoS>, 7>& profiles() {
  static const std::array<std::pair<std::string_view, QoS>, 7> all{{
      {"clock", QoS(1).best_effort()},
      {"parameter_events", QoS(1000)},
      {"parameters", QoS(1000)},
      {"rosout", QoS(1000).transient_local().lifespan(std::chrono::seconds(10))},
      {"sensor_data", QoS(5).best_effort()},
      {"services", QoS(10)},
      {"system_default", QoS()},
  }};
  return all;
}

bool is_longer(Nanoseconds offered, Nanoseconds requested) noexcept {
  return !QoS::is_for_ever(requested) && (QoS::is_for_ever(offered) || offered > requested);
}

}  // namespace

QoS& QoS::keep_all() noexcept {
  return keep_last(kMaxDepth);
}

void QoS::check() const {
  if (depth == 0 || depth > kMaxDepth) {
    throw Error(fmt::format("a history of {} messages cannot be kept", depth),
                fmt::format("choose a depth from 1 to {}", kMaxDepth));
  }
  for (const auto& [name, duration] : {std::pair("deadline", deadline_period),
                                       {"lifespan", lifespan_duration},
                                       {"lease_duration", lease_duration}}) {
    if (duration >= Nanoseconds::zero()) continue;
    throw Error(fmt::format("a {} of {} cannot be kept", name, to_string(duration)),
                "choose one above 0, or 0 for none");
  }
}

std::string_view QoS::refuses(const QoS& requested) const noexcept {
  if (reliability < requested.reliability) return "reliability";
  if (durability < requested.durability) return "durability";
  if (is_longer(deadline_period, requested.deadline_period)) return "deadline";
  if (liveliness_kind < requested.liveliness_kind) return "liveliness";
  if (is_longer(lease_duration, requested.lease_duration)) return "lease_duration";
  return {};
}

std::optional<QoS> qos_profile(std::string_view name) {
  for (const auto& [known, qos] : profiles()) {
    if (known == name) return qos;
  }
  return {};
}

std::vector<std::string> qos_profile_names() {
  std::vector<std::string> names;
  for (const auto& [name, qos] : profiles()) names.emplace_back(name);
  return names;
}

QoS QosOverrides::over(const QoS& code) const {
  QoS qos = profile.value_or(code);
  qos.depth = depth.value_or(qos.depth);
  qos.reliability = reliability.value_or(qos.reliability);
  qos.durability = durability.value_or(qos.durability);
  qos.liveliness_kind = liveliness.value_or(qos.liveliness_kind);
  qos.deadline_period = deadline.value_or(qos.deadline_period);
  qos.lifespan_duration = lifespan.value_or(qos.lifespan_duration);
  qos.lease_duration = lease_duration.value_or(qos.lease_duration);
  return qos;
}

}  // namespace takt
