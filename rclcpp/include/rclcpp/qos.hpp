// Quality of service, as programs for rclcpp write it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__QOS_HPP_
#define RCLCPP__QOS_HPP_

#include <string>

#include "takt/transport/qos.hpp"

#include "rclcpp/detail/refused.hpp"
#include "rclcpp/duration.hpp"
#include "rmw/qos_profiles.h"

namespace rclcpp {

std::string qos_policy_name_from_kind(rmw_qos_policy_kind_t kind);

enum class HistoryPolicy {
  KeepLast = RMW_QOS_POLICY_HISTORY_KEEP_LAST,
  KeepAll = RMW_QOS_POLICY_HISTORY_KEEP_ALL,
  SystemDefault = RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT,
  Unknown = RMW_QOS_POLICY_HISTORY_UNKNOWN,
};
enum class ReliabilityPolicy {
  BestEffort = RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT,
  Reliable = RMW_QOS_POLICY_RELIABILITY_RELIABLE,
  SystemDefault = RMW_QOS_POLICY_RELIABILITY_SYSTEM_DEFAULT,
  BestAvailable = RMW_QOS_POLICY_RELIABILITY_BEST_AVAILABLE,
  Unknown = RMW_QOS_POLICY_RELIABILITY_UNKNOWN,
};
enum class DurabilityPolicy {
  Volatile = RMW_QOS_POLICY_DURABILITY_VOLATILE,
  TransientLocal = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL,
  SystemDefault = RMW_QOS_POLICY_DURABILITY_SYSTEM_DEFAULT,
  BestAvailable = RMW_QOS_POLICY_DURABILITY_BEST_AVAILABLE,
  Unknown = RMW_QOS_POLICY_DURABILITY_UNKNOWN,
};
enum class LivelinessPolicy {
  Automatic = RMW_QOS_POLICY_LIVELINESS_AUTOMATIC,
  ManualByTopic = RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC,
  SystemDefault = RMW_QOS_POLICY_LIVELINESS_SYSTEM_DEFAULT,
  BestAvailable = RMW_QOS_POLICY_LIVELINESS_BEST_AVAILABLE,
  Unknown = RMW_QOS_POLICY_LIVELINESS_UNKNOWN,
};

struct QoSInitialization {
  rmw_qos_history_policy_t history_policy;
  std::size_t depth;

  QoSInitialization(rmw_qos_history_policy_t policy, std::size_t last)
      : history_policy(policy), depth(last) {}
  static QoSInitialization from_rmw(const rmw_qos_profile_t& profile) {
    return {profile.history, profile.depth};
  }
};
struct KeepAll : QoSInitialization {
  KeepAll() : QoSInitialization(RMW_QOS_POLICY_HISTORY_KEEP_ALL, 0) {}
};
struct KeepLast : QoSInitialization {
  explicit KeepLast(std::size_t last) : QoSInitialization(RMW_QOS_POLICY_HISTORY_KEEP_LAST, last) {}
};

/// Thread safety: a value. Real-time: yes.
class QoS {
 public:
  explicit QoS(const QoSInitialization& history,
               const rmw_qos_profile_t& profile = rmw_qos_profile_default)
      : profile_(profile) {
    profile_.history = history.history_policy;
    profile_.depth = history.depth;
  }
  QoS(std::size_t depth) : QoS(KeepLast(depth)) {}  // NOLINT: as in rclcpp

  rmw_qos_profile_t& get_rmw_qos_profile() { return profile_; }
  const rmw_qos_profile_t& get_rmw_qos_profile() const { return profile_; }

  QoS& history(rmw_qos_history_policy_t policy) { return profile_.history = policy, *this; }
  QoS& history(HistoryPolicy policy) {
    return history(static_cast<rmw_qos_history_policy_t>(policy));
  }
  QoS& keep_last(std::size_t depth) {
    profile_.depth = depth;
    return history(RMW_QOS_POLICY_HISTORY_KEEP_LAST);
  }
  QoS& keep_all() {
    profile_.depth = 0;
    return history(RMW_QOS_POLICY_HISTORY_KEEP_ALL);
  }
  QoS& reliability(rmw_qos_reliability_policy_t policy) {
    return profile_.reliability = policy, *this;
  }
  QoS& reliability(ReliabilityPolicy policy) {
    return reliability(static_cast<rmw_qos_reliability_policy_t>(policy));
  }
  QoS& reliable() { return reliability(RMW_QOS_POLICY_RELIABILITY_RELIABLE); }
  QoS& best_effort() { return reliability(RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT); }
  QoS& reliability_best_available() {
    return reliability(RMW_QOS_POLICY_RELIABILITY_BEST_AVAILABLE);
  }
  QoS& durability(rmw_qos_durability_policy_t policy) {
    return profile_.durability = policy, *this;
  }
  QoS& durability(DurabilityPolicy policy) {
    return durability(static_cast<rmw_qos_durability_policy_t>(policy));
  }
  QoS& durability_volatile() { return durability(RMW_QOS_POLICY_DURABILITY_VOLATILE); }
  QoS& transient_local() { return durability(RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL); }
  QoS& durability_best_available() { return durability(RMW_QOS_POLICY_DURABILITY_BEST_AVAILABLE); }
  QoS& deadline(rmw_time_t period) { return profile_.deadline = period, *this; }
  QoS& deadline(const Duration& period) { return deadline(period.to_rmw_time()); }
  QoS& lifespan(rmw_time_t duration) { return profile_.lifespan = duration, *this; }
  QoS& lifespan(const Duration& duration) { return lifespan(duration.to_rmw_time()); }
  QoS& liveliness(rmw_qos_liveliness_policy_t policy) {
    return profile_.liveliness = policy, *this;
  }
  QoS& liveliness(LivelinessPolicy policy) {
    return liveliness(static_cast<rmw_qos_liveliness_policy_t>(policy));
  }
  QoS& liveliness_lease_duration(rmw_time_t lease) {
    return profile_.liveliness_lease_duration = lease, *this;
  }
  QoS& liveliness_lease_duration(const Duration& lease) {
    return liveliness_lease_duration(lease.to_rmw_time());
  }
  RCLCPP_REFUSED_(avoid_ros_namespace_conventions, "topics without ROS's prefixes")

  HistoryPolicy history() const { return static_cast<HistoryPolicy>(profile_.history); }
  std::size_t depth() const { return profile_.depth; }
  ReliabilityPolicy reliability() const {
    return static_cast<ReliabilityPolicy>(profile_.reliability);
  }
  DurabilityPolicy durability() const { return static_cast<DurabilityPolicy>(profile_.durability); }
  Duration deadline() const { return Duration::from_rmw_time(profile_.deadline); }
  Duration lifespan() const { return Duration::from_rmw_time(profile_.lifespan); }
  LivelinessPolicy liveliness() const { return static_cast<LivelinessPolicy>(profile_.liveliness); }
  Duration liveliness_lease_duration() const {
    return Duration::from_rmw_time(profile_.liveliness_lease_duration);
  }

  /// Takt's QoS. SYSTEM_DEFAULT becomes reliable and volatile. BEST_AVAILABLE becomes volatile, and
  /// best effort for a subscription, reliable for a publisher: the other endpoints are not
  /// considered.
  takt::QoS to_takt(bool is_subscription) const;
  static QoS from_takt(const takt::QoS& qos);

 private:
  rmw_qos_profile_t profile_;
};
bool operator==(const QoS& left, const QoS& right);
namespace detail {
inline QoS qos_from_rmw(const rmw_qos_profile_t& profile) {
  return QoS(QoSInitialization::from_rmw(profile), profile);
}
}  // namespace detail

#define RCLCPP_QOS_(Name, profile)                                                         \
  class Name : public QoS {                                                                \
   public:                                                                                 \
    explicit Name(const QoSInitialization& history = QoSInitialization::from_rmw(profile)) \
        : QoS(history, profile) {}                                                         \
  };
class ClockQoS : public QoS {
 public:
  explicit ClockQoS(const QoSInitialization& history = KeepLast(1)) : QoS(history) {
    best_effort();
  }
};
RCLCPP_QOS_(SensorDataQoS, rmw_qos_profile_sensor_data)
RCLCPP_QOS_(ParametersQoS, rmw_qos_profile_parameters)
RCLCPP_QOS_(ServicesQoS, rmw_qos_profile_services_default)
RCLCPP_QOS_(ParameterEventsQoS, rmw_qos_profile_parameter_events)
RCLCPP_QOS_(RosoutQoS, rmw_qos_profile_rosout_default)
RCLCPP_QOS_(SystemDefaultsQoS, rmw_qos_profile_system_default)
RCLCPP_QOS_(BestAvailableQoS, rmw_qos_profile_best_available)
#undef RCLCPP_QOS_

}  // namespace rclcpp

#endif  // RCLCPP__QOS_HPP_
