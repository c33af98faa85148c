// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/document.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "takt/base/own_key.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"

namespace takt::document {
namespace {

// Limit: bytes of a configuration file. At it: the file is refused. Seen: the error.
constexpr std::size_t kMaxBytes = 4 << 20;
// Limit: levels of a configuration file. At it: the file is refused. Seen: the error.
constexpr std::size_t kMaxDepth = 64;
// Limit: errors that are reported of one file. At it: the rest is not looked for. Seen: the last
// error says so.
constexpr std::size_t kMaxErrors = 100;

// Error messages quote text of the file; each must stay one line and must not control the terminal.
std::string shown(const std::string& text) {
  std::string message = printable(text);
  // Limit: bytes of an error about a file. At it: its middle is left out. Seen: `…` in the error.
  constexpr std::size_t kMaxLength = 2000;
  if (message.size() <= kMaxLength) return message;
  // Cut the middle: an error begins with the place and ends with the advice. Do not split a UTF-8
  // character.
  std::size_t begin = kMaxLength / 2;
  std::size_t end = message.size() - kMaxLength / 2;
  const auto is_inside = [&](std::size_t at) { return (message[at] & 0xc0) == 0x80; };
  while (is_inside(begin)) --begin;
  while (is_inside(end)) ++end;
  return message.replace(begin, end - begin, " ... ");
}

// The length of the first UTF-8 character of the text; 0 if it is invalid.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) -> unsigned { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return 1;
  const std::size_t length = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc0 || byte(0) >= 0xf8 || text.size() < length) return 0;
  unsigned character = byte(0) & (0x7fU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return 0;
    character = character << 6U | (byte(i) & 0x3fU);
  }
  constexpr unsigned kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // refuses overlong encodings
  const bool is_surrogate = character >= 0xd800 && character < 0xe000;
  return character < kSmallest[length] || character > 0x10ffff || is_surrogate ? 0 : length;
}

// Reject control characters before parsing: yaml-cpp takes some for the end of the file.
void check_text(std::string_view text, const Errors& errors) {
  int line = 1;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const auto byte = static_cast<unsigned char>(text[0]);
    const bool is_control = byte < ' ' && byte != '\t' && byte != '\n' && byte != '\r';
    if (length == 0 || is_control) {
      errors.fail(line, fmt::format("the byte 0x{:02x} is not allowed in a text file", byte),
                  "give a file that is UTF-8 text");
    }
    if (byte == '\n') ++line;
    text.remove_prefix(length);
  }
}

std::string load(const std::string& path, const Errors& errors) {
  try {
    return RegularFile(path).text(kMaxBytes);
  } catch (const Error& error) {
    errors.fail(1, error.what(), "");
  }
}

const std::vector<Value>* values_in(const Value& container) {
  if (const Map* map = std::get_if<Map>(&container.content)) return &map->values;
  return std::get_if<List>(&container.content);
}

}  // namespace

// ---- Errors ----

void Errors::add(int line, const std::string& what, const std::string& what_to_do) {
  errors_.emplace_back(line, shown(Error(what, what_to_do, where(line)).what()));
  if (errors_.size() < kMaxErrors) return;
  errors_.emplace_back(line, where(line) + ": more errors follow; fix these first");
  throw_if_any();
}

bool Errors::passes(int line, const std::function<void()>& check) {
  try {
    check();
    return true;
  } catch (const OwnValueError& error) {
    add(error.line() != 0 ? error.line() : line, error.what(), {});
  } catch (const Error& error) {
    add(line, error.what(), {});
  }
  return false;
}

void Errors::fail(int line, const std::string& what, const std::string& what_to_do) const {
  throw ConfigurationError({shown(Error(what, what_to_do, where(line)).what())});
}

void Errors::throw_if_any() const {
  if (errors_.empty()) return;
  auto sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> messages;
  for (auto& [line, message] : sorted) messages.push_back(std::move(message));
  throw ConfigurationError(std::move(messages));
}

// ---- Values ----

const Value* find(const Value& map, std::string_view key) {
  const Map* content = std::get_if<Map>(&map.content);
  if (content == nullptr) return nullptr;
  const auto found = std::find_if(content->values.begin(), content->values.end(),
                                  [&](const Value& value) { return value.name == key; });
  return found == content->values.end() ? nullptr : &*found;
}

bool is_empty_list(const Value* value) noexcept {
  const auto* list = value != nullptr ? std::get_if<List>(&value->content) : nullptr;
  return list != nullptr && list->empty();
}

std::size_t count(const Value& value) {
  const std::vector<Value>* values = values_in(value);
  if (values == nullptr) return 1;
  return std::transform_reduce(values->begin(), values->end(), std::size_t{1}, std::plus<>(),
                               count);
}

// ---- Builder ----

bool Builder::wants_key() const {
  return !open_.empty() && std::holds_alternative<Map>(open_.back().content) && !key_;
}

void Builder::key(std::string name, int line) {
  check_text(name, line);
  key_ = Key{std::move(name), line};
}

void Builder::open(Value container) {
  name(container);
  account_for(container);
  if (open_.size() == kMaxDepth) {
    errors_.fail(container.line, fmt::format("this is nested deeper than {} levels", kMaxDepth),
                 "use fewer levels");
  }
  open_.push_back(std::move(container));
}

const Value& Builder::close() {
  Value container = std::move(open_.back());
  open_.pop_back();
  Map* const map = std::get_if<Map>(&container.content);
  if (map != nullptr && rules_ == Rules::configuration) drop_duplicates(*map);
  return put(std::move(container));
}

const Value& Builder::add(Value value) {
  name(value);
  account_for(value);
  if (const auto* text = std::get_if<std::string>(&value.content)) check_text(*text, value.line);
  return put(std::move(value));
}

void Builder::account_for(const Value& value) {
  count_ += count(value);
  if (count_ > kMaxValues) {
    errors_.fail(value.line, fmt::format("the file has more than {} values", kMaxValues),
                 "describe a smaller system, with fewer aliases");
  }
}

// An escape sequence can produce a zero byte, at which C strings end.
void Builder::check_text(std::string_view text, int line) const {
  if (text.find('\0') == std::string_view::npos) return;
  errors_.fail(line, "this text contains a zero byte", "remove it");
}

void Builder::name(Value& value) {
  if (key_) {
    value.name = std::move(key_->name);
    value.line = key_->line;
    key_.reset();
  } else if (!open_.empty()) {
    const auto& list = std::get<List>(open_.back().content);
    value.name = fmt::format("{}[{}]", open_.back().name, list.size());
  }
}

const Value& Builder::put(Value value) {
  if (open_.empty()) return root_ = std::move(value);
  Map* map = std::get_if<Map>(&open_.back().content);
  auto& values = map != nullptr ? map->values : std::get<List>(open_.back().content);
  return values.emplace_back(std::move(value));
}

void Builder::drop_duplicates(Map& map) {
  std::map<std::string, int, std::less<>> lines;
  std::erase_if(map.values, [&](const Value& value) {
    const auto [first, is_new] = lines.try_emplace(value.name, value.line);
    if (is_new) return false;
    errors_.add(value.line, fmt::format("'{}' is already in line {}", value.name, first->second),
                "remove one of them");
    return true;
  });
}

// ---- Files ----

void check_is_ours(const Value& root, const std::vector<std::string>& keys, const Errors& errors) {
  const auto* const map = std::get_if<Map>(&root.content);
  if (map == nullptr) {
    const bool is_list = std::holds_alternative<List>(root.content);
    errors.fail(root.line, is_list ? "the file is a list" : "the file is a single value",
                "write a map");
  }
  const auto is_near = [&](const Value& value) {
    return std::find(keys.begin(), keys.end(), value.name) != keys.end() ||
           suggest(value.name, keys).starts_with("did you mean");
  };
  if (map->values.empty() || std::any_of(map->values.begin(), map->values.end(), is_near)) return;
  errors.fail(root.line, "the file has no key that is known here",
              fmt::format("give one that has: {}", fmt::join(keys, ", ")));
}

bool is_json(std::string_view path) {
  return path.ends_with(".json");
}

Value read(const std::string& path, Errors& errors, Rules rules) {
  const std::string text = load(path, errors);
  check_text(text, errors);
  Value root;
  if (text.find_first_not_of(" \t\r\n") != std::string::npos) {
    root = is_json(path) ? parse_json(text, errors) : parse_yaml(text, errors, rules);
  }
  if (std::holds_alternative<std::monostate>(root.content)) {
    errors.fail(1, "the file is empty", "write a system description");
  }
  return root;
}

namespace {

/// The name of a list entry in a path: its `name`, its `component`, or its place.
std::string name_in_list(const Value& entry, std::size_t place) {
  for (const char* const key : {"name", "component"}) {
    const Value* name = find(entry, key);
    const auto* text = name != nullptr ? std::get_if<std::string>(&name->content) : nullptr;
    if (text != nullptr) return *text;
  }
  return std::to_string(place);
}

// The value that the next word of a path names; nullptr: there is none. `names` are the valid ones.
Value* child(Value& parent, std::string_view word, std::vector<std::string>& names) {
  Value* found = nullptr;
  const auto look_at = [&](Value& candidate, std::string name) {
    if (found == nullptr && name == word) found = &candidate;
    names.push_back(std::move(name));
  };
  if (auto* map = std::get_if<Map>(&parent.content)) {
    for (Value& value : map->values) look_at(value, value.name);
  } else if (auto* list = std::get_if<List>(&parent.content)) {
    for (std::size_t i = 0; i < list->size(); ++i) look_at((*list)[i], name_in_list((*list)[i], i));
  }
  return found;
}

}  // namespace

void set(Value& root, const Setting& setting, Errors& errors) {
  Errors of_value("'" + setting.value + "'");
  const Value value = parse_yaml(setting.value, of_value);
  of_value.throw_if_any();
  Value* place = &root;
  std::string_view rest = setting.path;
  while (!rest.empty()) {
    // Names may contain dots: take the longest that exists.
    std::vector<std::string> names;
    Value* next = nullptr;
    std::size_t end = rest.size();
    for (;; end = rest.rfind('.', end - 1)) {
      names.clear();
      next = child(*place, rest.substr(0, end), names);
      if (next != nullptr || end == 0 || rest.rfind('.', end - 1) == std::string_view::npos) break;
    }
    auto* const map = std::get_if<Map>(&place->content);
    if (next == nullptr && map != nullptr && rest.find('.') == std::string_view::npos) {
      next = &map->values.emplace_back(Value{std::string(rest), place->line, {}});
      end = rest.size();
    }
    if (next == nullptr) {
      const std::string word(rest.substr(0, rest.find('.')));
      errors.fail(place->line,
                  fmt::format("'{}' leads nowhere: there is no '{}'", setting.path, word),
                  suggest(word, names));
    }
    place = next;
    rest.remove_prefix(std::min(rest.size(), end + 1));
  }
  place->content = value.content;
}

}  // namespace takt::document
