// A configuration file as a tree in which everything knows its line.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_DOCUMENT_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_DOCUMENT_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"

namespace takt::document {

/// The errors of one file.
/// Thread safety: none.
/// Real-time: no.
class Errors {
 public:
  explicit Errors(std::string file) : file_(std::move(file)) {}

  void add(int line, const std::string& what, const std::string& what_to_do);
  /// Runs the check; the Error that it throws becomes an error of this line. Returns whether all
  /// was well.
  bool passes(int line, const std::function<void()>& check);
  /// For what leaves nothing to read on: throws a ConfigurationError of this error alone.
  [[noreturn]] void fail(int line, const std::string& what, const std::string& what_to_do) const;
  /// Throws a ConfigurationError of all errors in the order of their lines, if there are any.
  void throw_if_any() const;
  std::size_t size() const { return errors_.size(); }

  const std::string& file() const noexcept { return file_; }
  SourceLine where(int line) const { return file_ + ":" + std::to_string(line); }

 private:
  const std::string file_;
  std::vector<std::pair<int, std::string>> errors_;
};

struct Value;
using List = std::vector<Value>;
struct Map {
  std::vector<Value> values;  // each under its name, in the order of the file
};

/// One value with all that lies in it.
struct Value {
  std::string name;  // the key it stands under; in a list, "affinity[0]"
  int line = 1;      // where it begins, with its key if it has one
  std::variant<std::monostate, bool, std::int64_t, double, std::string, List, Map> content;
};

/// The value under this key, nullptr when there is none or it is no map.
const Value* find(const Value& map, std::string_view key);
bool is_empty_list(const Value* value) noexcept;
/// How many values these are, with all that lies in them.
std::size_t count(const Value& value);

/// More values than this, aliases expanded, are not a system but an attack or an accident.
inline constexpr std::size_t kMaxValues = 100'000;

/// Puts a tree together from a parser's events, within limits: depth and number of values, so that
/// whoever walks the tree may recurse. A key that stands twice is an error, and then counts once.
/// Thread safety: none.
/// Real-time: no.
class Builder {
 public:
  explicit Builder(Errors& errors) : errors_(errors) {}

  /// Whether a key must come next.
  bool wants_key() const;
  void key(std::string name, int line);
  /// Opens a list or a map, to which everything belongs until it is closed.
  void open(Value container);
  /// The container that was finished; valid until the next call.
  const Value& close();
  const Value& add(Value value);
  /// Counts values that are kept elsewhere.
  void account_for(const Value& value);

  Value take_root() { return std::move(root_); }

 private:
  struct Key {
    std::string name;
    int line;
  };

  void check_text(std::string_view text, int line) const;
  void name(Value& value);
  const Value& put(Value value);
  void drop_duplicates(Map& map);

  Errors& errors_;
  std::vector<Value> open_;  // the containers around what comes next, the innermost last
  std::optional<Key> key_;   // of what comes next
  std::size_t count_ = 0;
  Value root_;
};

/// The tree of a text; a ConfigurationError of the first error when its syntax is broken.
Value parse_yaml(const std::string& text, Errors& errors);
Value parse_json(std::string_view text, Errors& errors);

/// Whether the name of the file says that it is JSON; else it is YAML.
bool is_json(std::string_view path);
/// Reads a file that nobody has looked at before: whatever is in it, this ends soon, in a tree or
/// in a ConfigurationError of one error.
Value read(const std::string& path, Errors& errors);

}  // namespace takt::document

#endif  // TAKT_CONTAINERS_CONFIGURATION_DOCUMENT_HPP_
