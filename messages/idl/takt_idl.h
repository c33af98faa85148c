// What the files of the back end share: names, types and values of IDL in C++.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_IDL_TAKT_IDL_H_
#define TAKT_MESSAGES_IDL_TAKT_IDL_H_

#include <idl/processor.h>
#include <stdbool.h>
#include <stdio.h>

enum { kMostName = 1024 };

typedef struct {
  const idl_pstate_t* state;
  FILE* out;
  char scope[kMostName];  // the namespace that is open: "robot_msgs::msg"
  // Types are written as ROS 2 describes them: in C++ an octet is an unsigned char, as uint8 is.
  bool describes;
  bool has_messages, has_defaults;  // of the constructor that is written
  bool failed;
} Writer;

// Goes on, so that one run tells of all that is wrong.
void refuse(Writer* writer, const void* node, const char* format, ...);

void append(char* text, const char* more);

bool ends_with(const char* text, const char* end);

void cpp_name(const void* node, char* name);

// The namespace of a node; "" is the global one.
void cpp_scope(const void* node, char* scope);

// Types in package::msg, ::srv and ::action are ROS 2's: "package/msg/Name". Others have the name
// that they have in IDL.
void wire_name(const void* node, char* name);

// `user`: where an error is reported.
void cpp_type(Writer* writer, const void* user, const idl_type_spec_t* type, char* text);

// With the dimensions of the declarator: `long x[2][3]` is two arrays of three.
void declared_type(Writer* writer, const idl_type_spec_t* type, const idl_declarator_t* declarator,
                   char* text);

// A literal of IDL, or an enumerator.
void write_value(Writer* writer, const idl_const_expr_t* value);

const char* default_list(const void* node);

// Every field has a value from the start.
void write_default(Writer* writer, const idl_member_t* member, const idl_declarator_t* declarator);

#endif  // TAKT_MESSAGES_IDL_TAKT_IDL_H_
