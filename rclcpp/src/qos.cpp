// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/qos.hpp"

#include <algorithm>
#include <chrono>

namespace rclcpp {
namespace {

takt::Nanoseconds duration(rmw_time_t time) {
  return Duration::from_rmw_time(time).to_chrono();
}
rmw_time_t duration(takt::Nanoseconds time) {
  return Duration(time).to_rmw_time();
}

}  // namespace

std::string qos_policy_name_from_kind(rmw_qos_policy_kind_t kind) {
  switch (kind) {
    case RMW_QOS_POLICY_DURABILITY:
      return "DURABILITY_QOS_POLICY";
    case RMW_QOS_POLICY_DEADLINE:
      return "DEADLINE_QOS_POLICY";
    case RMW_QOS_POLICY_LIVELINESS:
      return "LIVELINESS_QOS_POLICY";
    case RMW_QOS_POLICY_RELIABILITY:
      return "RELIABILITY_QOS_POLICY";
    case RMW_QOS_POLICY_HISTORY:
      return "HISTORY_QOS_POLICY";
    case RMW_QOS_POLICY_LIFESPAN:
      return "LIFESPAN_QOS_POLICY";
    case RMW_QOS_POLICY_DEPTH:
      return "DEPTH_QOS_POLICY";
    case RMW_QOS_POLICY_LIVELINESS_LEASE_DURATION:
      return "LIVELINESS_LEASE_DURATION_QOS_POLICY";
    default:
      return "INVALID_QOS_POLICY";
  }
}

takt::QoS QoS::to_takt(bool is_subscription) const {
  takt::QoS qos(std::max<std::size_t>(profile_.depth, 1));
  if (profile_.history == RMW_QOS_POLICY_HISTORY_KEEP_ALL) qos.keep_all();
  const bool is_best_available = profile_.reliability == RMW_QOS_POLICY_RELIABILITY_BEST_AVAILABLE;
  if (profile_.reliability == RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT ||
      (is_best_available && is_subscription)) {
    qos.best_effort();
  }
  if (profile_.durability == RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL) qos.transient_local();
  if (profile_.liveliness == RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC) {
    qos.liveliness(takt::Liveliness::manual_by_topic);
  }
  qos.deadline(duration(profile_.deadline));
  qos.lifespan(duration(profile_.lifespan));
  qos.liveliness_lease_duration(duration(profile_.liveliness_lease_duration));
  return qos;
}

QoS QoS::from_takt(const takt::QoS& qos) {
  QoS result(qos.depth);
  if (qos.reliability == takt::Reliability::best_effort) result.best_effort();
  if (qos.durability == takt::Durability::transient_local) result.transient_local();
  result.liveliness(qos.liveliness_kind == takt::Liveliness::manual_by_topic
                        ? LivelinessPolicy::ManualByTopic
                        : LivelinessPolicy::Automatic);
  result.deadline(duration(qos.deadline_period));
  result.lifespan(duration(qos.lifespan_duration));
  return result.liveliness_lease_duration(duration(qos.lease_duration));
}

bool operator==(const QoS& left, const QoS& right) {
  const auto same = [](rmw_time_t a, rmw_time_t b) { return a.sec == b.sec && a.nsec == b.nsec; };
  const rmw_qos_profile_t &a = left.get_rmw_qos_profile(), &b = right.get_rmw_qos_profile();
  return a.history == b.history && a.depth == b.depth && a.reliability == b.reliability &&
         a.durability == b.durability && a.liveliness == b.liveliness &&
         same(a.deadline, b.deadline) && same(a.lifespan, b.lifespan) &&
         same(a.liveliness_lease_duration, b.liveliness_lease_duration);
}

}  // namespace rclcpp
