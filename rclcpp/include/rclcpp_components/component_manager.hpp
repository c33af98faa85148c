// Not supported: component managers. `takt run` and a container's services load components.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_COMPONENTS__COMPONENT_MANAGER_HPP_
#define RCLCPP_COMPONENTS__COMPONENT_MANAGER_HPP_

#error "Takt's layer for rclcpp has no component managers: see docs/reference/rclcpp.md"

#endif  // RCLCPP_COMPONENTS__COMPONENT_MANAGER_HPP_
