// The name that programs include for what is in rclcpp/publisher.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PUBLISHER_BASE_HPP_
#define RCLCPP__PUBLISHER_BASE_HPP_

#include "rclcpp/publisher.hpp"

#endif  // RCLCPP__PUBLISHER_BASE_HPP_
