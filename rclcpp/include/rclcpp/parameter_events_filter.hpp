// Not supported: filters of parameter events.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_EVENTS_FILTER_HPP_
#define RCLCPP__PARAMETER_EVENTS_FILTER_HPP_

#error "Takt's layer for rclcpp has no filters of parameter events: see docs/reference/rclcpp.md"

#endif  // RCLCPP__PARAMETER_EVENTS_FILTER_HPP_
