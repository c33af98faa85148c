// Programs may name these macros; nothing needs them here.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__VISIBILITY_CONTROL_HPP_
#define RCLCPP__VISIBILITY_CONTROL_HPP_

#define RCLCPP_EXPORT
#define RCLCPP_IMPORT
#define RCLCPP_PUBLIC
#define RCLCPP_PUBLIC_TYPE
#define RCLCPP_LOCAL

#endif  // RCLCPP__VISIBILITY_CONTROL_HPP_
