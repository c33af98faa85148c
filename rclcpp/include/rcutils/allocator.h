// Allocators of rcutils, which Takt's functions take and do not use.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCUTILS__ALLOCATOR_H_
#define RCUTILS__ALLOCATOR_H_

typedef struct rcutils_allocator_s {
  void* state;
} rcutils_allocator_t;

inline rcutils_allocator_t rcutils_get_default_allocator() {
  return {nullptr};
}

#endif  // RCUTILS__ALLOCATOR_H_
