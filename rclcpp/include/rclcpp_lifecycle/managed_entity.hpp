// The name that programs include for what is in rclcpp_lifecycle/lifecycle_publisher.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_LIFECYCLE__MANAGED_ENTITY_HPP_
#define RCLCPP_LIFECYCLE__MANAGED_ENTITY_HPP_

#include "rclcpp_lifecycle/lifecycle_publisher.hpp"

#endif  // RCLCPP_LIFECYCLE__MANAGED_ENTITY_HPP_
