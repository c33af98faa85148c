// Names, types and values of IDL in C++.
// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "takt_idl.h"

void refuse(Writer* writer, const void* node, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  idl_verror(writer->state, idl_location(node), format, arguments);
  va_end(arguments);
  writer->failed = true;
}

void append(char* text, const char* more) {
  const size_t used = strlen(text);
  snprintf(text + used, kMostName - used, "%s", more);
}

// ---- Names ----

static bool is_keyword(const char* name) {
  static const char kWords[] =
      " alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t "
      "char32_t char8_t class co_await co_return co_yield compl concept const const_cast "
      "consteval constexpr constinit continue decltype default delete do double dynamic_cast "
      "else enum explicit export extern false float for friend goto if inline int long mutable "
      "namespace new noexcept not not_eq nullptr operator or or_eq private protected public "
      "register reinterpret_cast requires return short signed sizeof static static_assert "
      "static_cast struct switch template this thread_local throw true try typedef typeid "
      "typename union unsigned using virtual void volatile wchar_t while xor xor_eq ";
  char word[kMostName];
  snprintf(word, sizeof word, " %s ", name);
  return strstr(kWords, word) != NULL;
}

bool ends_with(const char* text, const char* end) {
  const size_t length = strlen(text), end_length = strlen(end);
  return length > end_length && strcmp(text + length - end_length, end) == 0;
}

static const idl_node_t* module_of(const void* node) {
  const idl_node_t* above = idl_parent(node);
  while (above != NULL && !idl_is_module(above)) above = idl_parent(above);
  return above;
}

// On the wire, ROS 2's types lie in a module dds_ and have names that end in '_'. Both are left out
// in C++.
static bool is_dds_name(const void* node) {
  const idl_node_t* module = module_of(node);
  return module != NULL && idl_identifier_is(module, "dds_") &&
         ends_with(idl_identifier(node), "_");
}

void cpp_name(const void* node, char* name) {
  snprintf(name, kMostName, "%s", idl_identifier(node));
  if (is_dds_name(node)) name[strlen(name) - 1] = '\0';
  if (is_keyword(name)) append(name, "_");
}

void cpp_scope(const void* node, char* scope) {
  const idl_node_t* module = module_of(node);
  if (module == NULL) {
    scope[0] = '\0';
    return;
  }
  cpp_scope(module, scope);
  if (idl_identifier_is(module, "dds_")) return;
  if (scope[0] != '\0') append(scope, "::");
  char name[kMostName];
  cpp_name(module, name);
  append(scope, name);
}

// As one writes it in the namespace that is open.
static void cpp_reference(const Writer* writer, const void* node, char* reference) {
  char scope[kMostName], name[kMostName];
  cpp_scope(node, scope);
  cpp_name(node, name);
  reference[0] = '\0';
  if (strcmp(scope, writer->scope) != 0) {
    if (scope[0] != '\0') append(reference, "::");
    append(reference, scope);
    append(reference, "::");
  }
  append(reference, name);
}

static void idl_path(const void* node, const char* separator, char* path) {
  const idl_node_t* module = module_of(node);
  path[0] = '\0';
  if (module != NULL) {
    idl_path(module, separator, path);
    append(path, separator);
  }
  append(path, idl_identifier(node));
}

void wire_name(const void* node, char* name) {
  const idl_node_t* kind = module_of(node);
  if (is_dds_name(node)) kind = module_of(kind);
  const idl_node_t* package = kind != NULL ? module_of(kind) : NULL;
  if (package == NULL || module_of(package) != NULL ||
      !(idl_identifier_is(kind, "msg") || idl_identifier_is(kind, "srv") ||
        idl_identifier_is(kind, "action"))) {
    idl_path(node, "::", name);
    return;
  }
  snprintf(name, kMostName, "%s/%s/%s", idl_identifier(package), idl_identifier(kind),
           idl_identifier(node));
  if (is_dds_name(node)) name[strlen(name) - 1] = '\0';
}

// ---- Types ----

static const char* base_type(const Writer* writer, const void* type) {
  switch (idl_type(type)) {
    case IDL_BOOL:
      return "bool";
    case IDL_CHAR:
      return "char";
    case IDL_OCTET:
      return writer->describes ? "std::byte" : "unsigned char";
    case IDL_INT8:
      return "std::int8_t";
    case IDL_UINT8:
      return "std::uint8_t";
    case IDL_SHORT:
    case IDL_INT16:
      return "std::int16_t";
    case IDL_USHORT:
    case IDL_UINT16:
      return "std::uint16_t";
    case IDL_LONG:
    case IDL_INT32:
      return "std::int32_t";
    case IDL_ULONG:
    case IDL_UINT32:
      return "std::uint32_t";
    case IDL_LLONG:
    case IDL_INT64:
      return "std::int64_t";
    case IDL_ULLONG:
    case IDL_UINT64:
      return "std::uint64_t";
    case IDL_FLOAT:
      return "float";
    case IDL_DOUBLE:
      return "double";
    default:
      return NULL;
  }
}

static const idl_annotation_appl_t* annotation(const void* node, const char* name) {
  const idl_annotation_appl_t* applied = ((const idl_node_t*)node)->annotations;
  while (applied != NULL && strcmp(applied->annotation->name->identifier, name) != 0) {
    applied = idl_next(applied);
  }
  return applied;
}

// A wstring of ROS 2: idlc knows none, so the field is a string with an annotation.
static bool is_wide(const void* user) {
  while (user != NULL && !idl_is_member(user)) user = idl_parent(user);
  return user != NULL && annotation(user, "takt_wide") != NULL;
}

// Of a string or sequence that may have a bound.
static void container(const char* plain, uint32_t bound, char* text) {
  if (bound == 0) {
    snprintf(text, kMostName, "%s", plain);
  } else {
    snprintf(text, kMostName, "::takt::Bounded<%s, %" PRIu32 ">", plain, bound);
  }
}

void cpp_type(Writer* writer, const void* user, const idl_type_spec_t* type, char* text) {
  snprintf(text, kMostName, "?");
  if (idl_is_forward(type)) {
    refuse(writer, user,
           "'%s' is used before it is defined; define it above, and leave out types that contain "
           "themselves: refer to elements of a sequence by their index",
           idl_identifier(type));
  } else if (idl_is_alias(type) && writer->describes) {
    declared_type(writer, ((const idl_typedef_t*)idl_parent(type))->type_spec, type, text);
  } else if (idl_is_alias(type) || idl_is_enum(type)) {
    cpp_reference(writer, type, text);
  } else if (idl_is_struct(type)) {
    for (const idl_node_t* above = user; above != NULL; above = idl_parent(above)) {
      if (above != type) continue;
      refuse(writer, user,
             "'%s' contains itself, which a message cannot; refer to elements of a sequence by "
             "their index",
             idl_identifier(type));
    }
    cpp_reference(writer, type, text);
  } else if (idl_is_string(type)) {
    container(is_wide(user) ? "std::u16string" : "std::string",
              idl_is_bounded(type) ? idl_bound(type) : 0, text);
  } else if (idl_is_sequence(type)) {
    const idl_sequence_t* sequence = type;
    char element[kMostName], plain[kMostName] = "std::vector<";
    cpp_type(writer, user, sequence->type_spec, element);
    append(plain, element);
    append(plain, ">");
    container(plain, sequence->maximum, text);
  } else if (idl_is_base_type(type) && base_type(writer, type) != NULL) {
    snprintf(text, kMostName, "%s", base_type(writer, type));
  } else if (!idl_is_union(type) && !idl_is_bitmask(type)) {  // these are refused where they stand
    refuse(writer, user, "Takt's messages have no %s; use %s",
           idl_type(type) == IDL_LDOUBLE ? "long double" : idl_construct(type),
           idl_type(type) == IDL_LDOUBLE ? "double" : "another type");
  }
}

void declared_type(Writer* writer, const idl_type_spec_t* type, const idl_declarator_t* declarator,
                   char* text) {
  cpp_type(writer, declarator, type, text);
  const idl_node_t* dimension = declarator->const_expr;
  if (dimension == NULL) return;
  while (dimension->next != NULL) dimension = dimension->next;
  for (; dimension != NULL; dimension = dimension->previous) {
    char element[kMostName];
    snprintf(element, sizeof element, "%s", text);
    snprintf(text, kMostName, "std::array<");
    append(text, element);
    char size[32];
    snprintf(size, sizeof size, ", %" PRIu32 ">", ((const idl_literal_t*)dimension)->value.uint32);
    append(text, size);
  }
}

// ---- Values ----

static void write_character(FILE* out, char character) {
  if (character == '"' || character == '\\' || character == '\'') {
    fprintf(out, "\\%c", character);
  } else if (character >= ' ' && character <= '~') {
    fputc(character, out);
  } else {
    fprintf(out, "\\%03o", (unsigned char)character);  // octal: takes no digit that follows
  }
}

// With the fewest digits that are the same number again.
static void write_float(FILE* out, double value, bool is_single) {
  char text[64];
  for (int digits = 1;; ++digits) {
    snprintf(text, sizeof text, "%.*g", digits, value);
    if (is_single ? strtof(text, NULL) == (float)value : strtod(text, NULL) == value) break;
  }
  fprintf(out, "%s%s%s", text, strpbrk(text, ".en") == NULL ? ".0" : "", is_single ? "f" : "");
}

static void write_signed(FILE* out, int64_t value) {
  if (value == INT64_MIN) {
    fputs("INT64_MIN", out);  // as -9223372036854775808 is a minus before a number too large
  } else {
    fprintf(out, "%" PRId64, value);
  }
}

static bool write_integer(FILE* out, const idl_literal_t* literal) {
  switch (idl_type(literal)) {
    case IDL_INT8:
      write_signed(out, literal->value.int8);
      return true;
    case IDL_SHORT:
    case IDL_INT16:
      write_signed(out, literal->value.int16);
      return true;
    case IDL_LONG:
    case IDL_INT32:
      write_signed(out, literal->value.int32);
      return true;
    case IDL_LLONG:
    case IDL_INT64:
      write_signed(out, literal->value.int64);
      return true;
    case IDL_OCTET:
    case IDL_UINT8:
      fprintf(out, "%" PRIu8, literal->value.uint8);
      return true;
    case IDL_USHORT:
    case IDL_UINT16:
      fprintf(out, "%" PRIu16, literal->value.uint16);
      return true;
    case IDL_ULONG:
    case IDL_UINT32:
      fprintf(out, "%" PRIu32 "u", literal->value.uint32);
      return true;
    case IDL_ULLONG:
    case IDL_UINT64:
      fprintf(out, "%" PRIu64 "u", literal->value.uint64);
      return true;
    default:
      return false;
  }
}

void write_value(Writer* writer, const idl_const_expr_t* value) {
  FILE* out = writer->out;
  if (idl_is_enumerator(value)) {
    char type[kMostName], name[kMostName];
    cpp_reference(writer, idl_parent(value), type);
    cpp_name(value, name);
    fprintf(out, "%s::%s", type, name);
    return;
  }
  const idl_literal_t* literal = value;
  if (write_integer(out, literal)) return;
  switch (idl_type(value)) {
    case IDL_BOOL:
      fputs(literal->value.bln ? "true" : "false", out);
      break;
    case IDL_CHAR:
      fputc('\'', out);
      write_character(out, literal->value.chr);
      fputc('\'', out);
      break;
    case IDL_FLOAT:
      write_float(out, literal->value.flt, true);
      break;
    case IDL_DOUBLE:
      write_float(out, literal->value.dbl, false);
      break;
    case IDL_STRING:
      fputc('"', out);
      for (const char* c = literal->value.str; *c != '\0'; ++c) write_character(out, *c);
      fputc('"', out);
      break;
    default:
      refuse(writer, value, "Takt's messages have no value of this type; leave it out");
  }
}

const char* default_list(const void* node) {
  const idl_annotation_appl_t* applied = annotation(node, "takt_default_list");
  return applied == NULL ? NULL
                         : ((const idl_literal_t*)applied->parameters->const_expr)->value.str;
}

void write_default(Writer* writer, const idl_member_t* member, const idl_declarator_t* declarator) {
  const void* type = idl_strip(member->type_spec, IDL_STRIP_ALIASES);
  const char* list = default_list(member);
  if (list != NULL) {
    fprintf(writer->out, " = %s", list);
  } else if (member->value.value != NULL) {
    fputs(" = ", writer->out);
    write_value(writer, member->value.value);
  } else if (declarator->const_expr != NULL || idl_is_array(type)) {
    fputs("{}", writer->out);
  } else if (idl_is_enum(type)) {
    fputs(" = ", writer->out);
    write_value(writer, ((const idl_enum_t*)type)->default_enumerator);
  } else if (idl_type(type) == IDL_BOOL) {
    fputs(" = false", writer->out);
  } else if (idl_is_base_type(type)) {
    fputs(" = 0", writer->out);
  }
}
