// Callbacks for QoS events of publishers and subscriptions.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EVENT_HANDLER_HPP_
#define RCLCPP__EVENT_HANDLER_HPP_

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "takt/callback_groups/callback_group.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/nodes/node.hpp"

#include "rclcpp/exceptions/exceptions.hpp"
#include "rmw/types.h"

namespace rclcpp {

using exceptions::UnsupportedEventTypeException;

using QOSDeadlineRequestedInfo = rmw_requested_deadline_missed_status_t;
using QOSDeadlineOfferedInfo = rmw_offered_deadline_missed_status_t;
using QOSLivelinessChangedInfo = rmw_liveliness_changed_status_t;
using QOSLivelinessLostInfo = rmw_liveliness_lost_status_t;
using QOSMessageLostInfo = rmw_message_lost_status_t;
using QOSOfferedIncompatibleQoSInfo = rmw_offered_qos_incompatible_event_status_t;
using QOSRequestedIncompatibleQoSInfo = rmw_requested_qos_incompatible_event_status_t;
using MatchedInfo = rmw_matched_status_t;

using QOSDeadlineRequestedCallbackType = std::function<void(QOSDeadlineRequestedInfo&)>;
using QOSDeadlineOfferedCallbackType = std::function<void(QOSDeadlineOfferedInfo&)>;
using QOSLivelinessChangedCallbackType = std::function<void(QOSLivelinessChangedInfo&)>;
using QOSLivelinessLostCallbackType = std::function<void(QOSLivelinessLostInfo&)>;
using QOSMessageLostCallbackType = std::function<void(QOSMessageLostInfo&)>;
using QOSOfferedIncompatibleQoSCallbackType = std::function<void(QOSOfferedIncompatibleQoSInfo&)>;
using QOSRequestedIncompatibleQoSCallbackType =
    std::function<void(QOSRequestedIncompatibleQoSInfo&)>;
using PublisherMatchedCallbackType = std::function<void(MatchedInfo&)>;
using SubscriptionMatchedCallbackType = std::function<void(MatchedInfo&)>;

namespace detail {
/// Stands for a callback of an event that Takt does not have: assigning one does not compile.
struct NoEvent {
  template <class T>
  NoEvent& operator=(T&&) {
    static_assert(sizeof(T) == 0,
                  "Takt has no such event: see docs/reference/rclcpp.md, event callbacks");
    return *this;
  }
};
}  // namespace detail

struct PublisherEventCallbacks {
  QOSDeadlineOfferedCallbackType deadline_callback;
  QOSLivelinessLostCallbackType liveliness_callback;
  QOSOfferedIncompatibleQoSCallbackType incompatible_qos_callback;
  detail::NoEvent incompatible_type_callback;
  PublisherMatchedCallbackType matched_callback;
};
struct SubscriptionEventCallbacks {
  QOSDeadlineRequestedCallbackType deadline_callback;
  QOSLivelinessChangedCallbackType liveliness_callback;
  QOSRequestedIncompatibleQoSCallbackType incompatible_qos_callback;
  detail::NoEvent incompatible_type_callback;
  QOSMessageLostCallbackType message_lost_callback;
  SubscriptionMatchedCallbackType matched_callback;
};

namespace detail {
using Events = std::vector<std::shared_ptr<takt::Entity>>;
Events make_events(takt::Node& node, const takt::SubscriptionBase& subscription,
                   const SubscriptionEventCallbacks& callbacks,
                   const std::shared_ptr<takt::CallbackGroup>& group);
using SharedTime = std::shared_ptr<std::atomic<takt::TimePoint>>;
/// `asserted`: when the publisher last asserted its liveliness.
Events make_events(takt::Node& node, const takt::PublisherBase& publisher,
                   const SharedTime& asserted, const PublisherEventCallbacks& callbacks,
                   const std::shared_ptr<takt::CallbackGroup>& group);
}  // namespace detail

}  // namespace rclcpp

#endif  // RCLCPP__EVENT_HANDLER_HPP_
