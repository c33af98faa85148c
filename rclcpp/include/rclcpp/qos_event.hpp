// The name that programs include for what is in rclcpp/event_handler.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__QOS_EVENT_HPP_
#define RCLCPP__QOS_EVENT_HPP_

#include "rclcpp/event_handler.hpp"

#endif  // RCLCPP__QOS_EVENT_HPP_
