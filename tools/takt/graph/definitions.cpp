// SPDX-License-Identifier: Apache-2.0
#include "graph/definitions.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"

#include "embedded.hpp"

namespace takt::tools {
namespace {

namespace wire = type_description_interfaces::msg;

// Limit: bytes of an interface file. At it: the type is refused. Seen: the error.
constexpr std::size_t kMostDefinitionBytes = 1 << 20;
// Limit: characters of the name of a type. At it: the type is not known. Seen: the error.
constexpr std::size_t kMostName = 255;
// Of an interface with all that it refers to, each field's type as often as it occurs.
// Limit: lines of an interface with all that it contains. At it: the type is refused. Seen: the
// error.
constexpr std::size_t kMostLines = 100'000;
// Limit: elements of such an interface. At it: the type is refused. Seen: the error.
constexpr std::size_t kMostElements = std::size_t{1} << 26;
// Limit: levels of such an interface. At it: the type is refused. Seen: the error.
constexpr std::size_t kMostDepth = 64;

std::string without_comment(const std::string& text) {
  char quote = 0;
  std::size_t end = 0;
  for (; end < text.size() && (text[end] != '#' || quote != 0); ++end) {
    const char c = text[end];
    const bool is_escaped = end != 0 && text[end - 1] == '\\';
    if ((c != '"' && c != '\'') || is_escaped || (quote != 0 && quote != c)) continue;
    quote = quote == 0 ? c : 0;
  }
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), end);
  while (end > begin && (text[end - 1] == ' ' || text[end - 1] == '\t' || text[end - 1] == '\r')) {
    --end;
  }
  return text.substr(begin, end - begin);
}

std::optional<std::string> installed_text(const std::string& type) {
  static const std::regex kName("[A-Za-z][A-Za-z0-9_]*/(msg|srv|action)/[A-Za-z][A-Za-z0-9_]*");
  const char* prefixes = std::getenv("AMENT_PREFIX_PATH");
  std::smatch parts;
  if (prefixes == nullptr || type.size() > kMostName || !std::regex_match(type, parts, kName)) {
    return {};
  }
  std::istringstream list(prefixes);
  for (std::string prefix; std::getline(list, prefix, ':');) {
    const std::string path = fmt::format("{}/share/{}.{}", prefix, type, parts[1].str());
    if (access(path.c_str(), F_OK) == 0) return read_text(path, kMostDefinitionBytes);
  }
  return {};
}

std::vector<std::string> parts_of(const std::string& type) {
  const auto is_of = [&](const char* kind) { return type.find(kind) != std::string::npos; };
  if (is_of("/srv/")) return {type + "_Request", type + "_Response"};
  if (is_of("/action/")) return {type + "_Goal", type + "_Result", type + "_Feedback"};
  return {type};
}

[[noreturn]] void wrong(const std::string& type, const std::string& text) {
  throw Error(fmt::format("the definition of {} has a line '{}'", type, text),
              "write TYPE NAME, TYPE NAME DEFAULT or TYPE NAME=VALUE");
}

/// The number at the beginning of `text`, which is shortened by it.
std::size_t number(std::string_view& text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || value == 0) {
    throw Error(fmt::format("a definition has a type with the size '{}'",
                            text.substr(0, text.find_first_of("[]"))),
                "write a number from 1, such as uint8[3] or string<=10");
  }
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

/// "string<=10[<=3]", or "Point[4]", whose nested type is given.
wire::FieldType field_type(std::string_view text, const std::string& nested) {
  static const std::map<std::string_view, FieldShape::Id> kIds{
      {"bool", FieldShape::boolean},       {"byte", FieldShape::byte},
      {"char", FieldShape::uint8},         {"int8", FieldShape::int8},
      {"uint8", FieldShape::uint8},        {"int16", FieldShape::int16},
      {"uint16", FieldShape::uint16},      {"int32", FieldShape::int32},
      {"uint32", FieldShape::uint32},      {"int64", FieldShape::int64},
      {"uint64", FieldShape::uint64},      {"float32", FieldShape::float32},
      {"float64", FieldShape::float64},    {"string", FieldShape::string},
      {"wstring", FieldShape::wide_string}};
  const std::string_view base = text.substr(0, text.find_first_of("<["));
  const auto known = kIds.find(base);
  text.remove_prefix(base.size());
  std::uint8_t id = known != kIds.end() ? known->second : FieldShape::nested;
  wire::FieldType type;
  if (text.starts_with("<=")) {
    text.remove_prefix(2);
    type.string_capacity = number(text);
    id = id == FieldShape::string ? FieldShape::bounded_string : FieldShape::bounded_wide_string;
  }
  if (text.starts_with('[')) {
    text.remove_prefix(1);
    const bool is_bounded = text.starts_with("<=");
    if (is_bounded) text.remove_prefix(2);
    if (!text.starts_with(']')) type.capacity = number(text);
    id = static_cast<std::uint8_t>(id + (is_bounded           ? FieldShape::kBoundedSequence
                                         : type.capacity != 0 ? FieldShape::kArray
                                                              : FieldShape::kSequence));
  }
  return type.set__type_id(id).set__nested_type_name(nested);
}

[[noreturn]] void refuse(const std::string& type, std::string_view why) {
  throw Error(fmt::format("the definition of {} {}", type, why), "change its file");
}

template <class Integer>
bool fits(std::string_view text) {
  Integer value{};
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Whether a number of this type can have the value; of other types always.
bool is_value(std::string_view type, std::string_view text) {
  static const std::map<std::string_view, bool (*)(std::string_view)> kFit{
      {"byte", fits<std::uint8_t>},  {"char", fits<std::uint8_t>},
      {"int8", fits<std::int8_t>},   {"uint8", fits<std::uint8_t>},
      {"int16", fits<std::int16_t>}, {"uint16", fits<std::uint16_t>},
      {"int32", fits<std::int32_t>}, {"uint32", fits<std::uint32_t>},
      {"int64", fits<std::int64_t>}, {"uint64", fits<std::uint64_t>},
      {"float32", fits<float>},      {"float64", fits<double>}};
  const auto known = kFit.find(type);
  return known == kFit.end() || known->second(text);
}

/// The names of one message, and what its constants and defaults say.
class Names {
 public:
  void add(const DefinitionLine& line, const std::string& type) {
    constexpr std::string_view kLetters =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";
    if (line.name.find_first_not_of(kLetters) != std::string::npos ||
        kLetters.find(line.name[0]) >= kLetters.find('_')) {
      refuse(type,
             fmt::format("has the name '{}', which is not of letters, digits and '_'", line.name));
    }
    if (!names_.insert(line.name).second) refuse(type, fmt::format("has '{}' twice", line.name));
    const bool has_value = line.is_constant || !line.value.empty();
    if (has_value && !is_value(line.field_type, line.value)) {
      refuse(type, fmt::format("gives '{}' the value '{}', which is not one of {}", line.name,
                               line.value, line.field_type));
    }
    if (has_value && !line.nested.empty()) {
      refuse(type, fmt::format("gives '{}' a value, and {} has none", line.name, line.nested));
    }
    const bool is_list = line.field_type.ends_with(']');
    if (has_value && is_list && !(line.value.starts_with('[') && line.value.ends_with(']'))) {
      refuse(type,
             fmt::format("gives '{}' the value '{}', which is no list", line.name, line.value));
    }
  }
  void clear() { names_.clear(); }

 private:
  std::set<std::string> names_;
};

/// Computes how large interfaces are, each once.
class Sizes {
 public:
  struct Size {
    std::size_t lines = 0, elements = 0;
  };

  Size of(const std::string& type, std::size_t depth = 0) {
    const auto [entry, is_new] = sizes_.try_emplace(type);
    if (!is_new) {
      if (!entry->second) refuse(type, "contains itself");
      return *entry->second;
    }
    if (depth > kMostDepth) refuse(type, "contains others too deeply");
    Size size{1, 1};
    const auto lines = definition_lines(type);
    const auto separators = lines ? std::count(lines->begin(), lines->end(), kSeparator) : 0;
    if (lines && static_cast<std::size_t>(separators) + 1 != parts_of(type).size()) {
      refuse(type, "has too few or too many lines of '---'");
    }
    Names names;
    for (const std::string& text : lines.value_or(std::vector<std::string>())) {
      ++size.lines;
      if (text == kSeparator) names.clear();
      if (text.empty() || text == kSeparator) continue;
      const DefinitionLine line(text, type);
      names.add(line, type);
      if (line.is_constant) continue;
      const Size nested = line.nested.empty() ? Size{1, 1} : of(line.nested, depth + 1);
      const wire::FieldType field = checked_type(line, type);
      const bool is_array = FieldShape{field.type_id, field.capacity, 0}.is_array();
      const std::size_t count = is_array ? field.capacity : 1;
      if (count > kMostElements / nested.elements) refuse(type, "is too large");
      size.lines += nested.lines;
      size.elements += count * nested.elements;
      if (size.lines > kMostLines || size.elements > kMostElements) refuse(type, "is too large");
    }
    sizes_[type] = size;
    return size;
  }

 private:
  static wire::FieldType checked_type(const DefinitionLine& line, const std::string& type) {
    try {
      return field_type(line.field_type, line.nested);
    } catch (const Error& error) {
      throw Error(error.what(), "", type);
    }
  }
  std::map<std::string, std::optional<Size>> sizes_;  // nullopt: under way
};

/// Collects the messages of interfaces.
class Collection {
 public:
  /// Returns false if there is no definition.
  bool add(const std::string& type) {
    const std::vector<std::string> parts = parts_of(type);
    if (types.contains(parts.front())) return true;
    const auto lines = definition_lines(type);
    if (!lines) return false;
    for (const std::string& part : parts) types[part].type_name = part;
    auto part = parts.begin();
    for (const std::string& text : *lines) {
      if (text == kSeparator) {
        if (++part == parts.end()) wrong(type, text);
      } else if (!text.empty()) {
        const DefinitionLine line(text, type);
        if (line.is_constant) continue;
        if (!line.nested.empty() && !add(line.nested)) return false;
        types[*part].fields.push_back(wire::Field()
                                          .set__name(line.name)
                                          .set__type(field_type(line.field_type, line.nested))
                                          .set__default_value(line.value));
      }
    }
    for (const std::string& name : parts) {
      auto& fields = types[name].fields;
      if (!fields.empty()) continue;
      fields.push_back(wire::Field()
                           .set__name(std::string(kNoFields))
                           .set__type(wire::FieldType().set__type_id(FieldShape::uint8)));
    }
    return true;
  }

  std::map<std::string, wire::IndividualTypeDescription> types;
};

}  // namespace

std::optional<std::vector<std::string>> definition_lines(const std::string& type) {
  const auto embedded = std::find_if(kDefinitions.begin(), kDefinitions.end(),
                                     [&](const Definition& known) { return known.type == type; });
  std::optional<std::string> text;
  if (embedded != kDefinitions.end()) {
    text = embedded->text;
  } else {
    text = installed_text(type);
  }
  if (!text) return {};
  std::vector<std::string> lines;
  std::istringstream stream(*text);
  for (std::string line; std::getline(stream, line);) lines.push_back(without_comment(line));
  return lines;
}

DefinitionLine::DefinitionLine(const std::string& text, const std::string& type) {
  const std::size_t space = text.find_first_of(" \t");
  field_type = text.substr(0, space);
  const std::size_t begin = text.find_first_not_of(" \t", space);
  if (begin == std::string::npos) wrong(type, text);
  const std::size_t end = std::min(text.find_first_of(" \t=", begin), text.size());
  name = text.substr(begin, end - begin);
  const std::size_t next = std::min(text.find_first_not_of(" \t", end), text.size());
  is_constant = text.substr(next).starts_with('=');
  const std::size_t value_begin = text.find_first_not_of(" \t=", next);
  if (value_begin != std::string::npos) value = text.substr(value_begin);

  const std::string element = field_type.substr(0, field_type.find('['));
  if (const std::size_t slash = element.find('/'); slash != std::string::npos) {
    nested = element.substr(0, slash) + "/msg" + element.substr(element.rfind('/'));
  } else if (element[0] >= 'A' && element[0] <= 'Z') {
    nested =
        (element == "Header" ? "std_msgs" : type.substr(0, type.find('/'))) + "/msg/" + element;
  }
  if (is_constant && !nested.empty()) {
    throw Error(
        fmt::format("the definition of {} has the constant '{}' of a message's type", type, text),
        "choose a number, bool or string");
  }
}

void check_definition(const std::string& type) {
  Sizes().of(type);
}

std::optional<TypeDescription> defined(const std::string& type) {
  check_definition(type);
  Collection collection;
  if (!collection.add(type)) return {};
  TypeDescription description;
  const std::string first = parts_of(type).front();
  for (auto& [name, fields] : collection.types) {
    (name == first ? description.type_description
                   : description.referenced_type_descriptions.emplace_back()) = std::move(fields);
  }
  return description;
}

}  // namespace takt::tools
