// The time, as rcutils has it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__TIME_H_
#define RCUTILS__TIME_H_

#include "rcl/time.h"
#include "rcutils/types/rcutils_ret.h"

#define RCUTILS_S_TO_NS RCL_S_TO_NS
#define RCUTILS_MS_TO_NS RCL_MS_TO_NS
#define RCUTILS_US_TO_NS RCL_US_TO_NS
#define RCUTILS_NS_TO_S RCL_NS_TO_S
#define RCUTILS_NS_TO_MS RCL_NS_TO_MS
#define RCUTILS_NS_TO_US RCL_NS_TO_US

typedef rcl_time_point_value_t rcutils_time_point_value_t;
typedef rcl_duration_value_t rcutils_duration_value_t;

#ifdef __cplusplus
extern "C" {
#endif

/// In a simulated program, the virtual time. Thread safety: from any thread. Real-time: yes.
rcutils_ret_t rcutils_system_time_now(rcutils_time_point_value_t* now);
rcutils_ret_t rcutils_steady_time_now(rcutils_time_point_value_t* now);

#ifdef __cplusplus
}
#endif

#endif  // RCUTILS__TIME_H_
