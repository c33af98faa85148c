// SPDX-License-Identifier: Apache-2.0
#include "graph/dynamic_message.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include <boost/locale/encoding_utf.hpp>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/json_text.hpp"

namespace takt::tools {
namespace {

using nlohmann::ordered_json;
/// Size of an array element in bytes; 0: variable.
std::size_t size_of(FieldShape::Id id) {
  switch (id) {
    case FieldShape::int8:
    case FieldShape::uint8:
    case FieldShape::character:
    case FieldShape::boolean:
    case FieldShape::byte:
      return 1;
    case FieldShape::int16:
    case FieldShape::uint16:
      return 2;
    case FieldShape::int32:
    case FieldShape::uint32:
    case FieldShape::float32:
      return 4;
    case FieldShape::int64:
    case FieldShape::uint64:
    case FieldShape::float64:
      return 8;
    default:
      return 0;
  }
}

// Begins the text that replaces the rest of a long array.
constexpr std::string_view kCut = "... (";

// ---- Bytes → fields ----

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const ReadOptions& options)
      : body_(bytes.size() < kCdrHeader.size() + options.skipped
                  ? throw Error("the bytes are not a message")
                  : bytes.subspan(kCdrHeader.size())),
        offset_(options.skipped),
        most_(options.most),
        bytes_as_text_(options.bytes_as_text) {}

  ordered_json message(const MessageType& type) {
    ordered_json result = ordered_json::object();
    if (type.fields.empty()) number<std::uint8_t>();
    for (const MessageField& field : type.fields) result[field.name] = of(field.shape);
    return result;
  }

 private:
  ordered_json of(const FieldShape& shape) {
    if (!shape.is_array() && !shape.is_sequence()) return one(shape);
    const std::size_t count = shape.is_array() ? shape.capacity : number<std::uint32_t>();
    if (count > body_.size()) throw_short();  // each element has at least one byte
    ordered_json result = ordered_json::array();
    for (std::size_t i = 0; i < std::min(count, most_); ++i) result.push_back(one(shape));
    if (count <= most_) return result;
    if (const std::size_t size = size_of(shape.element()); size != 0) {
      take((count - most_) * size);
    } else {
      for (std::size_t i = most_; i < count; ++i) one(shape);
    }
    result.push_back(fmt::format("{}{} in all)", kCut, count));
    return result;
  }
  ordered_json one(const FieldShape& shape) {
    switch (shape.element()) {
      case FieldShape::nested:
        return message(*shape.type);
      case FieldShape::string:
      case FieldShape::bounded_string:
        return text();
      case FieldShape::wide_string:
      case FieldShape::bounded_wide_string:
        return wide_text();
      case FieldShape::boolean:
        return number<std::uint8_t>() != 0;
      case FieldShape::int8:
        return number<std::int8_t>();
      case FieldShape::byte:
        if (bytes_as_text_) return character(number<std::uint8_t>());
        [[fallthrough]];
      case FieldShape::uint8:
      case FieldShape::character:
        return number<std::uint8_t>();
      case FieldShape::int16:
        return number<std::int16_t>();
      case FieldShape::uint16:
        return number<std::uint16_t>();
      case FieldShape::int32:
        return number<std::int32_t>();
      case FieldShape::uint32:
        return number<std::uint32_t>();
      case FieldShape::int64:
        return number<std::int64_t>();
      case FieldShape::uint64:
        return number<std::uint64_t>();
      case FieldShape::float32:
        return number<float>();
      case FieldShape::float64:
        return number<double>();
    }
    throw Error("a field has no known type");
  }
  template <class T>
  T number() {
    offset_ += (sizeof(T) - offset_ % sizeof(T)) % sizeof(T);
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  std::string text() {
    const std::size_t size = number<std::uint32_t>();
    const auto* from = reinterpret_cast<const char*>(take(size));
    return {from, size == 0 ? 0 : size - 1};
  }
  static std::string character(std::uint8_t code) {
    return boost::locale::conv::utf_to_utf<char>(std::u16string(1, code));
  }
  std::string wide_text() {
    std::u16string text;
    for (auto left = number<std::uint32_t>(); left != 0; --left) {
      text += static_cast<char16_t>(number<std::uint32_t>());
    }
    return boost::locale::conv::utf_to_utf<char>(text);
  }
  const std::byte* take(std::size_t size) {
    if (offset_ > body_.size() || size > body_.size() - offset_) throw_short();
    const std::byte* from = body_.data() + offset_;
    offset_ += size;
    return from;
  }
  [[noreturn]] static void throw_short() {
    throw Error("the bytes end before the message does", "check the type of the message");
  }

  const std::span<const std::byte> body_;
  std::size_t offset_;
  const std::size_t most_;
  const bool bytes_as_text_;
};

// ---- Text → bytes ----

document::Value to_value(const ordered_json& from, const std::string& name) {
  document::Value value{.name = name};
  if (from.is_boolean()) {
    value.content = from.get<bool>();
  } else if (from.is_number_unsigned()) {  // of a field that takes it back, see integer()
    value.content = static_cast<std::int64_t>(from.get<std::uint64_t>());
  } else if (from.is_number_integer()) {
    value.content = from.get<std::int64_t>();
  } else if (from.is_number_float()) {
    value.content = from.get<double>();
  } else if (from.is_string()) {
    value.content = from.get<std::string>();
  } else if (from.is_array()) {
    document::List list;
    for (const ordered_json& item : from) list.push_back(to_value(item, name));
    value.content = std::move(list);
  } else if (from.is_object()) {
    document::Map map;
    for (const auto& [key, item] : from.items()) map.values.push_back(to_value(item, key));
    value.content = std::move(map);
  }
  return value;
}

// Limit: elements of an array that have a default value of their own. At it: zeros are sent. Seen:
// no.
constexpr std::size_t kMostDefaults = 1000;

/// The fields of a message that nobody has set, of a type of this program.
document::Value defaults_of(const MessageType& type) {
  ByteBuffer bytes;
  type.encode_defaults(bytes);
  return to_value(read_message(type, bytes.bytes(), {.most = kMostDefaults}), type.name);
}

/// What a definition says of a field: `1.0`, `[1, 2]`, `"a"`, `a b`.
document::Value default_of(const MessageField& field, document::Errors& errors) {
  const std::string& text = field.default_value;
  const bool is_text = field.shape.string_capacity != 0 ||
                       field.shape.element() == FieldShape::string ||
                       field.shape.element() == FieldShape::wide_string;
  const bool is_quoted = text.starts_with('"') || text.starts_with('\'') || text.starts_with('[');
  document::Value value{.content = text};
  if (!is_text || is_quoted)
    value = document::parse_yaml(text, errors, document::Rules::parameters);
  if (const auto* integer = std::get_if<std::int64_t>(&value.content);
      integer != nullptr && field.shape.id == FieldShape::boolean) {
    value.content = *integer != 0;
  }
  value.name = field.name;
  return value;
}

class Writer {
 public:
  Writer(ByteBuffer& bytes, document::Errors& errors) : bytes_(bytes), errors_(errors) {}

  /// `given`: nullptr for a message of defaults.
  void message(const MessageType& type, const document::Value* given) {
    const auto* map = given != nullptr ? std::get_if<document::Map>(&given->content) : nullptr;
    if (given != nullptr && map == nullptr &&
        !std::holds_alternative<std::monostate>(given->content)) {
      wrong(*given, fmt::format("a {} is a map of its fields", type.name));
    }
    if (map != nullptr) check_names(type, *map);
    if (type.fields.empty()) put<std::uint8_t>(0);
    for (const MessageField& field : type.fields) {
      const document::Value* value = map != nullptr ? document::find(*given, field.name) : nullptr;
      if (value != nullptr) {
        of(field.shape, value);
      } else {
        default_of(type, field);
      }
    }
  }

 private:
  void default_of(const MessageType& type, const MessageField& field) {
    if (!field.default_value.empty()) {
      const document::Value value = tools::default_of(field, errors_);
      return of(field.shape, &value);
    }
    const bool is_long = field.shape.is_array() && field.shape.capacity > kMostDefaults;
    if (type.encode_defaults == nullptr || is_long || field.shape.element() == FieldShape::nested) {
      return of(field.shape, nullptr);
    }
    const auto [known, is_new] = defaults_.try_emplace(&type);
    if (is_new) known->second = defaults_of(type);
    is_default_ = true;
    of(field.shape, document::find(known->second, field.name));
    is_default_ = false;
  }

  void check_names(const MessageType& type, const document::Map& map) {
    std::vector<std::string> names;
    for (const MessageField& field : type.fields) names.push_back(field.name);
    std::set<std::string> given;
    for (const document::Value& value : map.values) {
      if (!given.insert(value.name).second) wrong(value, "it is given twice");
      if (std::find(names.begin(), names.end(), value.name) != names.end()) continue;
      errors_.add(value.line, fmt::format("{} has no field '{}'", type.name, value.name),
                  suggest(value.name, names));
    }
  }

  void of(const FieldShape& shape, const document::Value* given) {
    if (!shape.is_array() && !shape.is_sequence()) return one(shape, given);
    const auto* list = given != nullptr ? std::get_if<document::List>(&given->content) : nullptr;
    if (given != nullptr && list == nullptr) return wrong(*given, "a list is wanted");
    const std::size_t count = list != nullptr ? list->size() : 0;
    if (count > shape.capacity && shape.capacity != 0) {
      return wrong(*given, fmt::format("there can be at most {}", shape.capacity));
    }
    const std::size_t wanted = shape.is_array() ? shape.capacity : count;
    if (shape.is_sequence()) put(static_cast<std::uint32_t>(count));
    for (std::size_t i = 0; i < wanted; ++i) one(shape, i < count ? &(*list)[i] : nullptr);
  }

  void one(const FieldShape& shape, const document::Value* given) {
    switch (shape.element()) {
      case FieldShape::nested:
        return message(*shape.type, given);
      case FieldShape::string:
      case FieldShape::bounded_string:
        return put(text(shape, given));
      case FieldShape::wide_string:
      case FieldShape::bounded_wide_string: {
        const auto wide = boost::locale::conv::utf_to_utf<char16_t>(text(shape, given));
        put(static_cast<std::uint32_t>(wide.size()));
        for (const char16_t character : wide) put(static_cast<std::uint32_t>(character));
        return;
      }
      case FieldShape::boolean: {
        const auto* value = given != nullptr ? std::get_if<bool>(&given->content) : nullptr;
        if (given != nullptr && value == nullptr) wrong(*given, "true or false is wanted");
        return put<std::uint8_t>(value != nullptr && *value ? 1 : 0);
      }
      case FieldShape::int8:
        return integer<std::int8_t>(given);
      case FieldShape::uint8:
      case FieldShape::byte:
      case FieldShape::character:
        return integer<std::uint8_t>(given);
      case FieldShape::int16:
        return integer<std::int16_t>(given);
      case FieldShape::uint16:
        return integer<std::uint16_t>(given);
      case FieldShape::int32:
        return integer<std::int32_t>(given);
      case FieldShape::uint32:
        return integer<std::uint32_t>(given);
      case FieldShape::int64:
        return integer<std::int64_t>(given);
      case FieldShape::uint64:
        return integer<std::uint64_t>(given);
      case FieldShape::float32:
        return put(static_cast<float>(real(given)));
      case FieldShape::float64:
        return put(real(given));
    }
  }

  std::string text(const FieldShape& shape, const document::Value* given) {
    std::string value;
    if (given != nullptr) {
      if (const auto* string = std::get_if<std::string>(&given->content)) {
        value = *string;
      } else {
        wrong(*given, "text is wanted; put it into quotation marks");
      }
    }
    if (shape.string_capacity != 0 && value.size() > shape.string_capacity) {
      wrong(*given, fmt::format("at most {} characters fit", shape.string_capacity));
    }
    return value;
  }
  void put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    std::memcpy(bytes_.extend(text.size() + 1), text.c_str(), text.size() + 1);
  }
  template <class T>
  void integer(const document::Value* given) {
    std::int64_t value = 0;
    if (given != nullptr) {
      const auto* found = std::get_if<std::int64_t>(&given->content);
      using Limits = std::numeric_limits<T>;
      const bool fits = found != nullptr && (is_default_ || std::in_range<T>(*found));
      if (!fits) {
        wrong(*given,
              fmt::format("an integer from {} to {} is wanted", Limits::min(), Limits::max()));
      } else {
        value = *found;
      }
    }
    put(static_cast<T>(value));
  }
  double real(const document::Value* given) {
    if (given == nullptr) return 0;
    if (const auto* value = std::get_if<double>(&given->content)) return *value;
    if (const auto* value = std::get_if<std::int64_t>(&given->content)) {
      return static_cast<double>(*value);
    }
    wrong(*given, "a number is wanted");
    return 0;
  }
  template <class T>
  void put(T value) {
    const std::size_t offset = bytes_.bytes().size() - kCdrHeader.size();
    const std::size_t padding = (sizeof(T) - offset % sizeof(T)) % sizeof(T);
    std::byte* to = bytes_.extend(padding + sizeof value);
    std::memset(to, 0, padding);
    std::memcpy(to + padding, &value, sizeof value);
  }
  void wrong(const document::Value& value, const std::string& what) {
    errors_.add(value.line, fmt::format("'{}': {}", value.name, what), "");
  }

  ByteBuffer& bytes_;
  document::Errors& errors_;
  std::map<const MessageType*, document::Value> defaults_;
  bool is_default_ = false;  // what is written
};

// JSON has no infinity and no NaN, and YAML 1.1 takes 1e+20 for a text.
std::string yaml_number(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  std::string text = rt::json_text(ordered_json(value));
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos && exponent != std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

void write_yaml(const ordered_json& value, std::size_t indent, std::string& text) {
  const std::string spaces(indent, ' ');
  if (value.is_object()) {
    for (const auto& [name, field] : value.items()) {
      const bool is_nested = (field.is_object() && !field.empty()) ||
                             (field.is_array() && !field.empty() && field.front().is_object());
      text += spaces + name + ":";
      if (is_nested) {
        text += '\n';
        write_yaml(field, indent + (field.is_object() ? 2 : 0), text);
      } else {
        text += ' ';
        write_yaml(field, 0, text);
        text += '\n';
      }
    }
  } else if (value.is_array()) {
    const bool is_nested = !value.empty() && value.front().is_object();
    const char* separator = "[";
    for (const ordered_json& element : value) {
      if (element.is_object()) {
        std::string fields;
        write_yaml(element, indent + 2, fields);
        fields[indent] = '-';
        text += fields;
      } else if (is_nested) {  // the text that replaces the rest
        text += spaces + element.get<std::string>() + "\n";
      } else {
        text += separator;
        write_yaml(element, 0, text);
        separator = ", ";
      }
    }
    if (!is_nested) text += value.empty() ? "[]" : "]";
  } else if (value.is_string() && value.get_ref<const std::string&>().starts_with(kCut)) {
    text += value.get_ref<const std::string&>();
  } else if (value.is_number_float()) {
    text += yaml_number(value.get<double>());
  } else {
    text += rt::json_text(value);
  }
}

}  // namespace

nlohmann::ordered_json read_message(const MessageType& type, std::span<const std::byte> bytes,
                                    const ReadOptions& options) {
  return Reader(bytes, options).message(type);
}

std::string to_yaml(const nlohmann::ordered_json& message) {
  std::string text;
  write_yaml(message, 0, text);
  return text;
}

ByteBuffer write_message(const MessageType& type, const std::string& text,
                         std::span<const std::byte> header) {
  document::Errors errors("the message");
  const document::Value value = document::parse_yaml(text, errors, document::Rules::parameters);
  errors.throw_if_any();
  ByteBuffer bytes;
  std::memcpy(bytes.extend(kCdrHeader.size()), kCdrHeader.data(), kCdrHeader.size());
  if (!header.empty()) std::memcpy(bytes.extend(header.size()), header.data(), header.size());
  Writer(bytes, errors).message(type, &value);
  errors.throw_if_any();
  return bytes;
}

}  // namespace takt::tools
