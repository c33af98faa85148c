// Not supported: expand_topic_or_service_name.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_
#define RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_

#error "Takt's layer for rclcpp has no expand_topic_or_service_name: see docs/reference/rclcpp.md"

#endif  // RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_
