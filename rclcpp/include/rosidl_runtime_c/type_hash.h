// The hash of a type, which tells whether two processes have the same definition of it.
// SPDX-License-Identifier: Apache-2.0
#ifndef ROSIDL_RUNTIME_C__TYPE_HASH_H_
#define ROSIDL_RUNTIME_C__TYPE_HASH_H_

#include <stdint.h>

#define ROSIDL_TYPE_HASH_VERSION_UNSET 0
#define ROSIDL_TYPE_HASH_SIZE 32

typedef struct rosidl_type_hash_s {
  uint8_t version;
  uint8_t value[ROSIDL_TYPE_HASH_SIZE];
} rosidl_type_hash_t;

#endif  // ROSIDL_RUNTIME_C__TYPE_HASH_H_
