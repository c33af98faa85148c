// Not supported: service introspection.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCL__SERVICE_INTROSPECTION_H_
#define RCL__SERVICE_INTROSPECTION_H_

#error "Takt's layer for rclcpp has no service introspection: see docs/reference/rclcpp.md"

#endif  // RCL__SERVICE_INTROSPECTION_H_
