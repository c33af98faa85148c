// Not supported: type support that is loaded by name.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TYPESUPPORT_HELPERS_HPP_
#define RCLCPP__TYPESUPPORT_HELPERS_HPP_

#error \
    "Takt's layer for rclcpp has no type support that is loaded by name: see docs/reference/rclcpp.md"

#endif  // RCLCPP__TYPESUPPORT_HELPERS_HPP_
