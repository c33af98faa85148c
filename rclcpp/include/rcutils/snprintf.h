// snprintf under the name of rcutils.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__SNPRINTF_H_
#define RCUTILS__SNPRINTF_H_

#include <stdio.h>

#define rcutils_snprintf snprintf

#endif  // RCUTILS__SNPRINTF_H_
