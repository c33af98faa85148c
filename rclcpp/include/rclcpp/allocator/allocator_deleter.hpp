// Not supported: allocators of messages.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_
#define RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_

#error "Takt's layer for rclcpp has no allocators of messages: see docs/reference/rclcpp.md"

#endif  // RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_
