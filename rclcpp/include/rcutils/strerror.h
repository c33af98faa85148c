// The message of errno under the name of rcutils.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__STRERROR_H_
#define RCUTILS__STRERROR_H_

#include <errno.h>
#include <stdio.h>
#include <string.h>

inline void rcutils_strerror(char* buffer, size_t size) {
  snprintf(buffer, size, "%s", strerror(errno));
}

#endif  // RCUTILS__STRERROR_H_
