// The last error, as rcl names it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCL__ERROR_HANDLING_H_
#define RCL__ERROR_HANDLING_H_

#include "rcutils/error_handling.h"

typedef rcutils_error_string_t rcl_error_string_t;
#define rcl_get_error_string rcutils_get_error_string
#define rcl_error_is_set rcutils_error_is_set
#define rcl_reset_error rcutils_reset_error

#endif  // RCL__ERROR_HANDLING_H_
