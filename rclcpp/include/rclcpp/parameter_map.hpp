// Not supported: maps of parameters.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_MAP_HPP_
#define RCLCPP__PARAMETER_MAP_HPP_

#error "Takt's layer for rclcpp has no maps of parameters: see docs/reference/rclcpp.md"

#endif  // RCLCPP__PARAMETER_MAP_HPP_
