// The last error of rcutils: always none, as Takt's functions throw or return the reason.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__ERROR_HANDLING_H_
#define RCUTILS__ERROR_HANDLING_H_

#include "rcutils/types/rcutils_ret.h"

typedef struct rcutils_error_string_s {
  char str[32];
} rcutils_error_string_t;

inline rcutils_error_string_t rcutils_get_error_string() {
  return {"error not set"};
}
inline bool rcutils_error_is_set() {
  return false;
}
inline void rcutils_reset_error() {
}

#endif  // RCUTILS__ERROR_HANDLING_H_
