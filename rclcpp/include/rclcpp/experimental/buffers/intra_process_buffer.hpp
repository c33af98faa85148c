// Not supported: rclcpp's buffers inside a process.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXPERIMENTAL__BUFFERS__INTRA_PROCESS_BUFFER_HPP_
#define RCLCPP__EXPERIMENTAL__BUFFERS__INTRA_PROCESS_BUFFER_HPP_

#error \
    "Takt's layer for rclcpp has no rclcpp's buffers inside a process: see docs/reference/rclcpp.md"

#endif  // RCLCPP__EXPERIMENTAL__BUFFERS__INTRA_PROCESS_BUFFER_HPP_
