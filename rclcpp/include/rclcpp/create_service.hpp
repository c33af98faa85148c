// The name that programs include for what is in rclcpp/create_publisher.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CREATE_SERVICE_HPP_
#define RCLCPP__CREATE_SERVICE_HPP_

#include "rclcpp/create_publisher.hpp"

#endif  // RCLCPP__CREATE_SERVICE_HPP_
