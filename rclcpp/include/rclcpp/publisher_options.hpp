// Options of publishers.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PUBLISHER_OPTIONS_HPP_
#define RCLCPP__PUBLISHER_OPTIONS_HPP_

#include <memory>

#include "rclcpp/callback_group.hpp"
#include "rclcpp/event_handler.hpp"
#include "rclcpp/qos_overriding_options.hpp"

namespace rclcpp {

/// No effect: inside a process, Takt always delivers by pointer.
enum class IntraProcessSetting { Enable, Disable, NodeDefault };

struct PublisherOptionsBase {
  IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
  PublisherEventCallbacks event_callbacks;
  bool use_default_callbacks = true;
  /// No effect: see docs/reference/rclcpp.md.
  rmw_unique_network_flow_endpoints_requirement_t require_unique_network_flow_endpoints =
      RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_NOT_REQUIRED;
  std::shared_ptr<CallbackGroup> callback_group;
  QosOverridingOptions qos_overriding_options;
};

template <class Allocator>
struct PublisherOptionsWithAllocator : PublisherOptionsBase {
  static constexpr bool kIsStandard = std::is_same_v<Allocator, std::allocator<void>>;
  PublisherOptionsWithAllocator() requires kIsStandard {}
  [[deprecated("Takt allocates messages itself: see docs/reference/rclcpp.md")]]  // NOLINTNEXTLINE
  PublisherOptionsWithAllocator() requires(!kIsStandard) {}

  std::shared_ptr<Allocator> allocator;
  std::shared_ptr<Allocator> get_allocator() const { return std::make_shared<Allocator>(); }
};
using PublisherOptions = PublisherOptionsWithAllocator<std::allocator<void>>;

}  // namespace rclcpp

#endif  // RCLCPP__PUBLISHER_OPTIONS_HPP_
