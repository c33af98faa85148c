// Quality of service of publishers and subscriptions; the names are those of rclcpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_QOS_HPP_
#define TAKT_TRANSPORT_QOS_HPP_

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

enum class Reliability { best_effort, reliable };
enum class Durability {
  volatile_,        // a late subscription receives only later messages
  transient_local,  // it also receives the publisher's last `depth` messages
};
enum class Liveliness {
  automatic,        // a publisher is alive while its process is
  manual_by_topic,  // it must publish, or assert its liveliness
};

/// The policies of DDS, as far as ROS 2 has them. A duration of 0 is none: no deadline, for ever.
/// So is one above 68 years, for which DDS has no number.
///
/// Every history is bounded: a full one loses its oldest message, which is counted.
struct QoS {
  // Not explicit: rclcpp's users write `create_publisher<T>("topic", 10)`.
  QoS(std::size_t last = 10) : depth(last) {}  // NOLINT(google-explicit-constructor)

  QoS& keep_last(std::size_t last) noexcept { return depth = last, *this; }
  /// As many as a subscription's ring can hold: 16,384.
  QoS& keep_all() noexcept;
  QoS& reliable() noexcept { return reliability = Reliability::reliable, *this; }
  QoS& best_effort() noexcept { return reliability = Reliability::best_effort, *this; }
  QoS& durability_volatile() noexcept { return durability = Durability::volatile_, *this; }
  QoS& transient_local() noexcept { return durability = Durability::transient_local, *this; }
  /// Maximum time between two messages that a publisher offers or a subscription requires.
  QoS& deadline(Nanoseconds period) noexcept { return deadline_period = period, *this; }
  /// Older messages are not delivered. For publishers.
  QoS& lifespan(Nanoseconds duration) noexcept { return lifespan_duration = duration, *this; }
  QoS& liveliness(Liveliness kind) noexcept { return liveliness_kind = kind, *this; }
  /// A publisher that is silent for longer is not alive.
  QoS& liveliness_lease_duration(Nanoseconds lease) noexcept {
    return lease_duration = lease, *this;
  }

  static constexpr bool is_for_ever(Nanoseconds duration) noexcept {
    return duration == Nanoseconds::zero() || duration > std::chrono::seconds(INT32_MAX);
  }
  /// Throws Error when the depth is 0 or beyond what a subscription's ring can hold, or a duration
  /// is negative.
  void check() const;
  /// The first policy of which less is offered here than `requested` asks for, by its name in
  /// files; empty when they are compatible: a publisher of this QoS serves a subscription of that.
  std::string_view refuses(const QoS& requested) const noexcept;

  friend bool operator==(const QoS&, const QoS&) = default;

  std::size_t depth;
  Reliability reliability = Reliability::reliable;
  Durability durability = Durability::volatile_;
  Liveliness liveliness_kind = Liveliness::automatic;
  Nanoseconds deadline_period{0}, lifespan_duration{0}, lease_duration{0};
};

/// rclcpp's profiles, by the names that its users know: sensor_data, system_default, services,
/// parameters, parameter_events, rosout, clock. Each is how a topic of that kind is usually offered
/// and asked for. nullopt: there is none of that name.
std::optional<QoS> qos_profile(std::string_view name);
std::vector<std::string> qos_profile_names();

/// What is decided about a topic from outside; the rest is as the code says.
struct QosOverrides {
  std::optional<QoS> profile;  // instead of the code's
  std::optional<std::size_t> depth;
  std::optional<Reliability> reliability;
  std::optional<Durability> durability;
  std::optional<Liveliness> liveliness;
  std::optional<Nanoseconds> deadline, lifespan, lease_duration;

  QoS over(const QoS& code) const;
};
/// By the topic's name, with all its namespaces.
using TopicQos = std::map<std::string, QosOverrides, std::less<>>;

}  // namespace takt

#endif  // TAKT_TRANSPORT_QOS_HPP_
