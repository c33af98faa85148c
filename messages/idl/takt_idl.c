// The back end of Cyclone's IDL compiler that writes Takt's messages: `idlc -l THIS -H BODY x.idl`
// makes C++ classes of the shape that ROS 2's have. takt_messages.py runs it, and turns the
// includes of IDL files, which stand at the top as they were found, into those of headers.
//
// IDL has default values for single values only; ROS 2 has lists, which takt_messages.py writes in
// C++'s words into an annotation of its own, @takt_default_list.
//
// In C, as libidl's headers are no C++. Not linked with libcycloneddsidl: idlc has it.
// SPDX-License-Identifier: Apache-2.0
#include "takt_idl.h"

#include <idlc/generator.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

// What rosidl gives a message without fields; Takt's encoding does the same by itself.
static const char kNoField[] = "structure_needs_at_least_one_member";
// rosidl's place for the constants of struct X: module X_Constants, beside it.
static const char kConstants[] = "_Constants";

// ---- What idlc asks of a back end ----

static const char* output_path;
static const idlc_option_t kOutput = {IDLC_STRING, {.string = &output_path},  'H', "",
                                      "<file>",    "Write the C++ to <file>."};
static const idlc_option_t* kOptions[] = {&kOutput, NULL};

const idlc_option_t** generator_options(void) {
  return kOptions;
}

// ---- Declarations ----

// Opens the node's namespace, and closes what was open.
static void enter(Writer* writer, const void* node) {
  char scope[kMostName] = "";
  if (node != NULL) cpp_scope(node, scope);
  if (strcmp(scope, writer->scope) == 0) {
    if (node != NULL) fputc('\n', writer->out);
    return;
  }
  if (writer->scope[0] != '\0') fprintf(writer->out, "\n}  // namespace %s\n", writer->scope);
  if (scope[0] != '\0') {
    // As ROS 2's messages have it: std_msgs::msg::to_yaml(message).
    fprintf(writer->out, "\nnamespace %s {\n\nusing ::takt::to_yaml;\n", scope);
  }
  if (node != NULL) fputc('\n', writer->out);
  snprintf(writer->scope, sizeof writer->scope, "%s", scope);
}

// Of that name in the same module, with `ending` behind it; NULL when there is none.
static const idl_node_t* sibling(const void* node, size_t length, const char* ending,
                                 idl_mask_t mask) {
  const char* name = idl_identifier(node);
  const idl_node_t* other = node;
  while (other->previous != NULL) other = other->previous;
  for (; other != NULL; other = other->next) {
    if ((idl_mask(other) & mask) == 0 || idl_is_forward(other)) continue;
    const char* others = idl_identifier(other);
    if (strncmp(others, name, length) == 0 && strcmp(others + length, ending) == 0) return other;
  }
  return NULL;
}

static void write_const(Writer* writer, const idl_const_t* constant, const char* before) {
  char name[kMostName], type[kMostName] = "constexpr ";
  cpp_name(constant, name);
  if (idl_is_string(idl_strip(constant->type_spec, IDL_STRIP_ALIASES))) {
    snprintf(type, sizeof type, "inline const std::string");
  } else {
    char plain[kMostName];
    cpp_type(writer, constant, constant->type_spec, plain);
    append(type, plain);
  }
  fprintf(writer->out, "%s%s %s = ", before, type, name);
  write_value(writer, constant->const_expr);
  fputs(";\n", writer->out);
}

static void write_typedef(Writer* writer, const idl_typedef_t* alias) {
  for (const idl_declarator_t* declarator = alias->declarators; declarator != NULL;
       declarator = idl_next(declarator)) {
    char name[kMostName], type[kMostName];
    cpp_name(declarator, name);
    declared_type(writer, alias->type_spec, declarator, type);
    fprintf(writer->out, "using %s = %s;\n", name, type);
  }
}

// Unsigned, as idlc counts enumerators so.
static void write_enum(Writer* writer, const idl_enum_t* type) {
  char name[kMostName];
  cpp_name(type, name);
  const unsigned bits = type->bit_bound.value == 0    ? 32
                        : type->bit_bound.value <= 8  ? 8
                        : type->bit_bound.value <= 16 ? 16
                                                      : 32;
  fprintf(writer->out, "enum class %s : std::uint%u_t {\n", name, bits);
  for (const idl_enumerator_t* one = type->enumerators; one != NULL; one = idl_next(one)) {
    cpp_name(one, name);
    fprintf(writer->out, "  %s = %" PRIu32 ",\n", name, one->value.value);
  }
  fputs("};\n", writer->out);
}

static void check_member(Writer* writer, const idl_member_t* member) {
  if (member->key.value) {
    refuse(writer, member,
           "Takt's topics have no keys; remove @key, and the field is one as the others");
  }
  if (member->optional.value) {
    refuse(writer, member,
           "Takt's messages have no @optional fields; use a sequence<T, 1>, or a flag beside it");
  }
}

typedef void (*FieldVisitor)(Writer*, const idl_member_t*, const idl_declarator_t*, size_t number);

// Calls `visit` for each field, those of the struct that it inherits from first: in final CDR they
// lie there as if they were its own. Returns how many there are.
static size_t for_each_field(Writer* writer, const idl_struct_t* type, size_t number,
                             FieldVisitor visit) {
  if (type->inherit_spec != NULL) {
    number = for_each_field(writer, type->inherit_spec->base, number, visit);
  }
  for (const idl_member_t* member = type->members; member != NULL; member = idl_next(member)) {
    for (const idl_declarator_t* declarator = member->declarators; declarator != NULL;
         declarator = idl_next(declarator)) {
      if (idl_identifier_is(declarator, kNoField)) continue;
      visit(writer, member, declarator, number++);
    }
  }
  return number;
}

static void write_field(Writer* writer, const idl_member_t* member,
                        const idl_declarator_t* declarator, size_t number) {
  (void)number;
  char name[kMostName], type[kMostName];
  check_member(writer, member);
  cpp_name(declarator, name);
  declared_type(writer, member->type_spec, declarator, type);
  fprintf(writer->out, "  %s %s", type, name);
  write_default(writer, member, declarator);
  fputs(";\n", writer->out);
}

static bool has_default(const idl_member_t* member) {
  return default_list(member) != NULL || member->value.value != NULL;
}

// A message that is a field by itself, not in an array or sequence.
static bool is_message(const idl_member_t* member, const idl_declarator_t* declarator) {
  return declarator->const_expr == NULL &&
         idl_is_struct(idl_strip(member->type_spec, IDL_STRIP_ALIASES));
}

static void find_messages_and_defaults(Writer* writer, const idl_member_t* member,
                                       const idl_declarator_t* declarator, size_t number) {
  (void)number;
  writer->has_messages |= is_message(member, declarator);
  writer->has_defaults |= has_default(member);
}

static void write_initialized(Writer* writer, const idl_member_t* member,
                              const idl_declarator_t* declarator, size_t number) {
  (void)number;
  if (!is_message(member, declarator)) return;
  char name[kMostName];
  cpp_name(declarator, name);
  fprintf(writer->out, "%s%s(how_)", writer->has_messages ? "\n      : " : ", ", name);
  writer->has_messages = false;  // the first one is written
}

static void write_zero(Writer* writer, const idl_member_t* member,
                       const idl_declarator_t* declarator, size_t number) {
  (void)number;
  if (!has_default(member)) return;
  char name[kMostName];
  cpp_name(declarator, name);
  fprintf(writer->out, "    %s = {};\n", name);
}

// What ROS 2's messages can be made with. Parameters have names that no field has.
static void write_constructors(Writer* writer, const idl_struct_t* type, const char* name) {
  writer->has_messages = writer->has_defaults = false;
  for_each_field(writer, type, 0, find_messages_and_defaults);
  const bool is_used = writer->has_messages || writer->has_defaults;
  fprintf(writer->out,
          "  %s_() = default;\n"
          "  explicit %s_(%s::takt::MessageInitialization%s)",
          name, name, is_used ? "" : "[[maybe_unused]] ", " how_");
  if (writer->has_messages) for_each_field(writer, type, 0, write_initialized);
  fputs(" {", writer->out);
  if (writer->has_defaults) {
    fputs("\n    if (how_ != ::takt::MessageInitialization::ZERO) return;\n", writer->out);
    for_each_field(writer, type, 0, write_zero);
    fputs("  ", writer->out);
  }
  fprintf(writer->out,
          "}\n"
          "  explicit %s_(const Allocator&, ::takt::MessageInitialization how_ =\n"
          "      ::takt::MessageInitialization::ALL)\n"
          "      : %s_(how_) {}\n\n",
          name, name);
}

static void write_setter(Writer* writer, const idl_member_t* member,
                         const idl_declarator_t* declarator, size_t number) {
  (void)number;
  char name[kMostName], type[kMostName];
  cpp_name(declarator, name);
  declared_type(writer, member->type_spec, declarator, type);
  fprintf(writer->out,
          "  using _%s_type = %s;\n"
          "  Type& set__%s(_%s_type value_) {\n"
          "    %s = std::move(value_);\n"
          "    return *this;\n"
          "  }\n",
          name, type, name, name, name);
}

static void write_description(Writer* writer, const idl_member_t* member,
                              const idl_declarator_t* declarator, size_t number) {
  (void)number;
  char name[kMostName], type[kMostName];
  cpp_name(declarator, name);
  writer->describes = true;
  declared_type(writer, member->type_spec, declarator, type);
  writer->describes = false;
  fprintf(writer->out,
          "             ::takt::detail::describe_field<%s>(\"%s\", offsetof(Type, %s)),\n", type,
          name, name);
}

static void write_visit(Writer* writer, const idl_member_t* member,
                        const idl_declarator_t* declarator, size_t number) {
  (void)member, (void)number;
  char name[kMostName];
  cpp_name(declarator, name);
  fprintf(writer->out, "    visitor_(message_.%s);\n", name);
}

// What TAKT_MESSAGE gives a plain struct.
static void write_message_type(Writer* writer, const idl_struct_t* type) {
  char wire[kMostName];
  wire_name(type, wire);
  fprintf(writer->out,
          "  friend const ::takt::MessageType& takt_message_type(const Type*) {\n"
          "    static const ::takt::MessageType& type = ::takt::detail::make_message_type(\n"
          "        \"%s\", ::takt::detail::kLayoutOf<Type>,\n        {\n",
          wire);
  for_each_field(writer, type, 0, write_description);
  fputs("        });\n    return type;\n  }\n", writer->out);
  static const char* const kConst[] = {"", "const "};
  for (int i = 0; i < 2; ++i) {
    fprintf(writer->out,
            "  template <class Visitor>\n"
            "  friend void takt_visit_fields(Visitor& visitor_, [[maybe_unused]] %sType& message_) "
            "{\n",
            kConst[i]);
    if (for_each_field(writer, type, 0, write_visit) == 0) {
      fputs("    visitor_.no_fields();\n", writer->out);
    }
    fputs("  }\n", writer->out);
  }
}

// `struct X { using Request = X_Request; … };`, for Node::create_service<X>.
static void write_group(Writer* writer, const idl_struct_t* last, const char* const* parts) {
  const char* name = idl_identifier(last);
  const char* ending = NULL;
  for (const char* const* part = parts; *part != NULL; ++part) ending = *part;
  if (!ends_with(name, ending)) return;
  const size_t length = strlen(name) - strlen(ending);
  if (sibling(last, length, "", IDL_STRUCT) != NULL) return;
  for (const char* const* part = parts; *part != NULL; ++part) {
    if (sibling(last, length, *part, IDL_STRUCT) == NULL) return;
  }
  fprintf(writer->out, "\nstruct %.*s {\n", (int)length, name);
  for (const char* const* part = parts; *part != NULL; ++part) {
    fprintf(writer->out, "  using %s = %.*s%s;\n", *part + 1, (int)length, name, *part);
  }
  fputs("};\n", writer->out);
}

static void write_struct(Writer* writer, const idl_struct_t* type) {
  static const char* const kService[] = {"_Request", "_Response", NULL};
  static const char* const kAction[] = {"_Goal", "_Result", "_Feedback", NULL};
  char name[kMostName];
  cpp_name(type, name);
  if (type->extensibility.annotation != NULL && type->extensibility.value != IDL_FINAL) {
    refuse(writer, type, "'%s' is @%s, and Takt sends plain CDR; make it @final", name,
           type->extensibility.value == IDL_MUTABLE ? "mutable" : "appendable");
  }
  if ((idl_allowable_data_representations(type) & IDL_DATAREPRESENTATION_FLAG_XCDR1) == 0) {
    refuse(writer, type, "'%s' may not be sent as XCDR1, and Takt sends nothing else; add XCDR1",
           name);
  }
  if (type->keylist != NULL) {
    refuse(writer, type->keylist, "Takt's topics have no keys; remove the keylist of '%s'", name);
  }

  fprintf(writer->out,
          "template <class Allocator>\n"
          "struct %s_ : ::takt::MessagePointers<%s_<Allocator>> {\n"
          "  using Type = %s_;\n",
          name, name, name);
  const idl_node_t* constants = sibling(type, strlen(idl_identifier(type)), kConstants, IDL_MODULE);
  if (constants != NULL) {
    const idl_node_t* constant = ((const idl_module_t*)constants)->definitions;
    for (; constant != NULL; constant = constant->next) {
      if (idl_is_const(constant)) {
        write_const(writer, (const idl_const_t*)constant, "  static ");
      }
    }
  }
  fputc('\n', writer->out);
  write_constructors(writer, type, name);
  if (for_each_field(writer, type, 0, write_field) > 0) fputc('\n', writer->out);
  if (writer->failed) return;  // what follows would say the same once more
  for_each_field(writer, type, 0, write_setter);
  fputs("  friend bool operator==(const Type&, const Type&) = default;\n\n", writer->out);
  write_message_type(writer, type);
  fprintf(writer->out, "};\nusing %s = %s_<std::allocator<void>>;\n", name, name);
  write_group(writer, type, kService);
  write_group(writer, type, kAction);
}

static bool is_of_this_file(const Writer* writer, const idl_node_t* node) {
  return strcmp(node->symbol.location.first.source->path->name,
                writer->state->sources->path->name) == 0;
}

static void write_definitions(Writer* writer, const idl_node_t* node) {
  for (; node != NULL; node = node->next) {
    if (!is_of_this_file(writer, node)) continue;
    if (idl_is_module(node)) {
      const char* name = idl_identifier(node);
      if (ends_with(name, kConstants) &&
          sibling(node, strlen(name) - strlen(kConstants), "", IDL_STRUCT) != NULL) {
        continue;  // they are written into the struct
      }
      write_definitions(writer, ((const idl_module_t*)node)->definitions);
    } else if (idl_is_union(node)) {
      refuse(writer, node,
             "'%s' is a union, which Takt's messages have not; use a struct with a field for each "
             "case, and one that tells which",
             idl_identifier(node));
    } else if (idl_is_bitmask(node)) {
      refuse(writer, node,
             "'%s' is a bitmask, which Takt's messages have not; use an unsigned integer, and "
             "constants for its bits",
             idl_identifier(node));
    } else if (!idl_is_forward(node)) {
      const bool is_const = idl_is_const(node);
      if (is_const || idl_is_typedef(node) || idl_is_enum(node) || idl_is_struct(node)) {
        // A typedef has no name of its own, but its declarators, which lie in it.
        enter(writer, node);
      }
      if (is_const) write_const(writer, (const idl_const_t*)node, "");
      if (idl_is_typedef(node)) write_typedef(writer, (const idl_typedef_t*)node);
      if (idl_is_enum(node)) write_enum(writer, (const idl_enum_t*)node);
      if (idl_is_struct(node)) write_struct(writer, (const idl_struct_t*)node);
    }
  }
}

int generate(const idl_pstate_t* state, const idlc_generator_config_t* config) {
  (void)config;
  char* text = NULL;
  size_t size = 0;
  Writer writer = {.state = state, .out = open_memstream(&text, &size)};
  if (writer.out == NULL || output_path == NULL) return IDL_RETCODE_BAD_PARAMETER;

  for (const idl_source_t* source = state->sources->includes; source; source = source->next) {
    fprintf(writer.out, "#include \"%s\"\n", source->path->name);
  }
  write_definitions(&writer, state->root);
  enter(&writer, NULL);
  fclose(writer.out);

  int result = writer.failed ? IDL_RETCODE_SEMANTIC_ERROR : IDL_RETCODE_OK;
  if (!writer.failed) {
    FILE* file = fopen(output_path, "w");
    if (file == NULL || fwrite(text, 1, size, file) != size || fclose(file) != 0) {
      result = IDL_RETCODE_NO_ACCESS;
    }
  }
  free(text);
  return result;
}
