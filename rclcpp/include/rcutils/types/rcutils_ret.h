// Return values of rcutils.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__TYPES__RCUTILS_RET_H_
#define RCUTILS__TYPES__RCUTILS_RET_H_

typedef int rcutils_ret_t;
#define RCUTILS_RET_OK 0
#define RCUTILS_RET_WARN 1
#define RCUTILS_RET_ERROR 2
#define RCUTILS_RET_BAD_ALLOC 10
#define RCUTILS_RET_INVALID_ARGUMENT 11
#define RCUTILS_RET_LOGGING_SEVERITY_STRING_INVALID 31

#endif  // RCUTILS__TYPES__RCUTILS_RET_H_
