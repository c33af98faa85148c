// Options of subscriptions.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SUBSCRIPTION_OPTIONS_HPP_
#define RCLCPP__SUBSCRIPTION_OPTIONS_HPP_

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "rclcpp/callback_group.hpp"
#include "rclcpp/event_handler.hpp"
#include "rclcpp/publisher_options.hpp"
#include "rclcpp/qos.hpp"

namespace rclcpp {

enum class TopicStatisticsState { Enable, Disable, NodeDefault };

struct ContentFilterOptions {
  std::string filter_expression;
  std::vector<std::string> expression_parameters;
};

struct SubscriptionOptionsBase {
  SubscriptionEventCallbacks event_callbacks;
  bool use_default_callbacks = true;
  bool ignore_local_publications = false;
  rmw_unique_network_flow_endpoints_requirement_t require_unique_network_flow_endpoints =
      RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_NOT_REQUIRED;
  std::shared_ptr<CallbackGroup> callback_group;
  IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
  struct TopicStatisticsOptions {
    TopicStatisticsState state = TopicStatisticsState::NodeDefault;
    std::string publish_topic = "/statistics";
    std::chrono::milliseconds publish_period = std::chrono::seconds(1);
    QoS qos = SystemDefaultsQoS().keep_last(10);
  } topic_stats_options;
  QosOverridingOptions qos_overriding_options;
  /// No effect: messages come unfiltered and is_cft_enabled() is false, as over an RMW without
  /// content filters.
  ContentFilterOptions content_filter_options;
};

template <class Allocator>
struct SubscriptionOptionsWithAllocator : SubscriptionOptionsBase {
  static constexpr bool kIsStandard = std::is_same_v<Allocator, std::allocator<void>>;
  SubscriptionOptionsWithAllocator() requires kIsStandard {}
  [[deprecated("Takt allocates messages itself: see docs/reference/rclcpp.md")]]  // NOLINTNEXTLINE
  SubscriptionOptionsWithAllocator() requires(!kIsStandard) {}

  std::shared_ptr<Allocator> allocator;
  std::shared_ptr<Allocator> get_allocator() const { return std::make_shared<Allocator>(); }
};
using SubscriptionOptions = SubscriptionOptionsWithAllocator<std::allocator<void>>;

}  // namespace rclcpp

#endif  // RCLCPP__SUBSCRIPTION_OPTIONS_HPP_
