// Not supported: parameter services of their own.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_SERVICE_HPP_
#define RCLCPP__PARAMETER_SERVICE_HPP_

#error \
    "Takt's layer for rclcpp has no parameter services of their own: see docs/reference/rclcpp.md"

#endif  // RCLCPP__PARAMETER_SERVICE_HPP_
