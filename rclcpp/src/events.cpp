// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string_view>
#include <type_traits>
#include <utility>

#include "rclcpp/event_handler.hpp"

namespace rclcpp::detail {
namespace {

rmw_qos_policy_kind_t kind_of(std::string_view policy) {
  constexpr std::pair<std::string_view, rmw_qos_policy_kind_t> kKinds[] = {
      {"reliability", RMW_QOS_POLICY_RELIABILITY},   {"durability", RMW_QOS_POLICY_DURABILITY},
      {"deadline", RMW_QOS_POLICY_DEADLINE},         {"liveliness", RMW_QOS_POLICY_LIVELINESS},
      {"lease_duration", RMW_QOS_POLICY_LIVELINESS}, {"lifespan", RMW_QOS_POLICY_LIFESPAN}};
  for (const auto& [name, kind] : kKinds) {
    if (name == policy) return kind;
  }
  return RMW_QOS_POLICY_INVALID;
}

rmw_requested_deadline_missed_status_t to_rmw(const takt::DeadlineMissedStatus& status) {
  return {static_cast<std::int32_t>(status.total_count),
          static_cast<std::int32_t>(status.total_count_change)};
}
rmw_liveliness_changed_status_t to_rmw(const takt::LivelinessChangedStatus& status) {
  return {static_cast<std::int32_t>(status.alive_count),
          static_cast<std::int32_t>(status.not_alive_count),
          static_cast<std::int32_t>(status.alive_count_change),
          static_cast<std::int32_t>(status.not_alive_count_change)};
}
rmw_requested_qos_incompatible_event_status_t to_rmw(const takt::IncompatibleQosStatus& status) {
  return {static_cast<std::int32_t>(status.total_count),
          static_cast<std::int32_t>(status.total_count_change), kind_of(status.last_policy)};
}
rmw_message_lost_status_t to_rmw(const takt::MessageLostStatus& status) {
  return {status.total_count, status.total_count_change};
}
rmw_matched_status_t to_rmw(const takt::MatchedStatus& status) {
  return {status.total_count, status.total_count_change,
          static_cast<std::size_t>(status.current_count),
          static_cast<std::int32_t>(status.current_count_change)};
}

template <class Status, class End, class Callback>
void add(Events& events, takt::Node& node, const End& end, const Callback& callback,
         const std::shared_ptr<takt::CallbackGroup>& group) {
  if (!callback) return;
  if constexpr (std::is_same_v<Status, takt::DeadlineMissedStatus>) {
    if (takt::QoS::is_for_ever(end.qos().deadline_period)) return;  // infinite, so never missed
  }
  events.push_back(node.create_qos_event<Status>(
      end,
      [callback](const Status& status) {
        auto info = to_rmw(status);
        callback(info);
      },
      group));
}

/// Adds a timer that checks, four times in a lease duration, whether the publisher has published or
/// asserted its liveliness. With automatic liveliness there is nothing to check: the publisher is
/// alive as long as its process.
void add_liveliness_lost(Events& events, takt::Node& node, const takt::PublisherBase& publisher,
                         const SharedTime& asserted, const QOSLivelinessLostCallbackType& callback,
                         const std::shared_ptr<takt::CallbackGroup>& group) {
  const takt::Nanoseconds lease = publisher.qos().lease_duration;
  if (!callback || publisher.qos().liveliness_kind != takt::Liveliness::manual_by_topic ||
      takt::QoS::is_for_ever(lease)) {
    return;
  }
  struct Lost {
    std::atomic<takt::TimePoint> since{};
    std::atomic<std::int32_t> count{0};
  };
  events.push_back(node.create_wall_timer(
      std::max<takt::Nanoseconds>(lease / 4, std::chrono::milliseconds(1)),
      [of = publisher.events(), asserted, callback, lease, lost = std::make_shared<Lost>()] {
        const takt::TimePoint alive = std::max(of->last_message(), asserted->load());
        if (takt::between(alive, takt::Clock::steady().now()) < lease) return;
        if (lost->since.exchange(alive) == alive) return;  // this loss was reported before
        rmw_liveliness_lost_status_t status{++lost->count, 1};
        callback(status);
      },
      group));
}

}  // namespace

Events make_events(takt::Node& node, const takt::SubscriptionBase& subscription,
                   const SubscriptionEventCallbacks& callbacks,
                   const std::shared_ptr<takt::CallbackGroup>& group) {
  Events events;
  add<takt::DeadlineMissedStatus>(events, node, subscription, callbacks.deadline_callback, group);
  add<takt::LivelinessChangedStatus>(events, node, subscription, callbacks.liveliness_callback,
                                     group);
  add<takt::IncompatibleQosStatus>(events, node, subscription, callbacks.incompatible_qos_callback,
                                   group);
  add<takt::MessageLostStatus>(events, node, subscription, callbacks.message_lost_callback, group);
  add<takt::MatchedStatus>(events, node, subscription, callbacks.matched_callback, group);
  return events;
}
Events make_events(takt::Node& node, const takt::PublisherBase& publisher,
                   const SharedTime& asserted, const PublisherEventCallbacks& callbacks,
                   const std::shared_ptr<takt::CallbackGroup>& group) {
  Events events;
  add<takt::DeadlineMissedStatus>(events, node, publisher, callbacks.deadline_callback, group);
  add<takt::IncompatibleQosStatus>(events, node, publisher, callbacks.incompatible_qos_callback,
                                   group);
  add<takt::MatchedStatus>(events, node, publisher, callbacks.matched_callback, group);
  add_liveliness_lost(events, node, publisher, asserted, callbacks.liveliness_callback, group);
  return events;
}

}  // namespace rclcpp::detail
