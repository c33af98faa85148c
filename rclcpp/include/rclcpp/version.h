// The version of rclcpp whose API this is: programs choose code by it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__VERSION_H_
#define RCLCPP__VERSION_H_

#define RCLCPP_VERSION_MAJOR (28)
#define RCLCPP_VERSION_MINOR (1)
#define RCLCPP_VERSION_PATCH (6)
#define RCLCPP_VERSION_STR "28.1.6"
#define RCLCPP_VERSION_GTE(major, minor, patch) \
  (RCLCPP_VERSION_MAJOR > (major) ||            \
   (RCLCPP_VERSION_MAJOR == (major) &&          \
    (RCLCPP_VERSION_MINOR > (minor) ||          \
     (RCLCPP_VERSION_MINOR == (minor) && RCLCPP_VERSION_PATCH >= (patch)))))

#endif  // RCLCPP__VERSION_H_
