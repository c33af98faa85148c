// The parts of rcl that programs get from this header.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCL__RCL_H_
#define RCL__RCL_H_

#include "rcl/allocator.h"
#include "rcl/error_handling.h"
#include "rcl/time.h"
#include "rcl/types.h"

#endif  // RCL__RCL_H_
