// States of service introspection, which Takt does not have: see docs/reference/rclcpp.md.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCL__SERVICE_INTROSPECTION_H_
#define RCL__SERVICE_INTROSPECTION_H_

typedef enum rcl_service_introspection_state_e {
  RCL_SERVICE_INTROSPECTION_OFF,
  RCL_SERVICE_INTROSPECTION_METADATA,
  RCL_SERVICE_INTROSPECTION_CONTENTS,
} rcl_service_introspection_state_t;

#endif  // RCL__SERVICE_INTROSPECTION_H_
