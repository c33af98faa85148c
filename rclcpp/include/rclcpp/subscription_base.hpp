// The name that programs include for what is in rclcpp/subscription.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SUBSCRIPTION_BASE_HPP_
#define RCLCPP__SUBSCRIPTION_BASE_HPP_

#include "rclcpp/subscription.hpp"

#endif  // RCLCPP__SUBSCRIPTION_BASE_HPP_
