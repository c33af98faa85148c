// Service introspection of clients and services, which is always off.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__SERVICE_INTROSPECTION_HPP_
#define RCLCPP__DETAIL__SERVICE_INTROSPECTION_HPP_

#include "rcl/service_introspection.h"
#include "rclcpp/clock.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/qos.hpp"

namespace rclcpp::detail {

/// Thread safety: immutable. Real-time: no.
class ServiceIntrospection {
 public:
  /// Introspection stays off: any other state throws exceptions::RCLError.
  [[deprecated("Takt has no service introspection: see docs/reference/rclcpp.md")]] void
  configure_introspection(const Clock::SharedPtr&, const QoS&,
                          rcl_service_introspection_state_t state) {
    if (state == RCL_SERVICE_INTROSPECTION_OFF) return;
    throw exceptions::RCLError(RCL_RET_UNSUPPORTED,
                               "Takt has no service introspection: see docs/reference/rclcpp.md");
  }
};

}  // namespace rclcpp::detail

#endif  // RCLCPP__DETAIL__SERVICE_INTROSPECTION_HPP_
