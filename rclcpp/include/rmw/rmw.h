// The name that programs include for what is in rmw/types.h.
// SPDX-License-Identifier: Apache-2.0
#ifndef RMW__RMW_H_
#define RMW__RMW_H_

#include "rmw/types.h"

#endif  // RMW__RMW_H_
