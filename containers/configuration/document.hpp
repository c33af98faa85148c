// A parsed configuration file: a tree of values with their line numbers.
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

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace takt {
namespace TAKT_INTERNAL document {

/// Collects the errors of one file.
/// Thread safety: none.
/// Real-time: no.
class Errors {
 public:
  explicit Errors(std::string file) : file_(std::move(file)) {}

  void add(int line, const std::string& what, const std::string& what_to_do);
  /// Runs a check. If it throws Error, adds it as an error of this line and returns false.
  bool passes(int line, const std::function<void()>& check);
  /// Throws a ConfigurationError of this error alone. For errors after which reading cannot go on.
  [[noreturn]] void fail(int line, const std::string& what, const std::string& what_to_do) const;
  /// If there are errors, throws them as one ConfigurationError, sorted by line.
  void throw_if_any() const;
  std::size_t size() const { return errors_.size(); }

  const std::string& file() const noexcept { return file_; }
  SourceLine where(int line) const { return file_ + ":" + std::to_string(line); }

 private:
  const std::string file_;
  std::vector<std::pair<int, std::string>> errors_;
};

/// How plain scalars, texts without quotes, get their types.
enum class Rules {
  configuration,  // as YAML 1.2's core schema says; aliases have the value of their anchor
  parameters      // as ROS 2's parser of parameter files has it: `yes` is true, 010 is 8
};

struct Value;
using List = std::vector<Value>;
struct Map {
  std::vector<Value> values;  // with their names, in the order of the file
};

/// A value, including nested values.
struct Value {
  std::string name;  // its key; in a list, "affinity[0]"
  int line = 1;      // of its key, or of its first character in a list
  std::variant<std::monostate, bool, std::int64_t, double, std::string, List, Map> content;
  std::string ambiguous = {};  // the text, if the other rules read another value; else empty
};

/// Adds an error with both readings of a value, or of a list's item, if ROS 2 would read it
/// otherwise.
void check_is_unambiguous(const Value& value, Errors& errors);

/// The value of a key; nullptr if the key is missing, or if `map` is no map.
const Value* find(const Value& map, std::string_view key);
bool is_empty_list(const Value* value) noexcept;
/// The number of values, including nested ones.
std::size_t count(const Value& value);

/// Maximum number of values with aliases expanded: far above any real system, and small enough to
/// stop a file whose aliases multiply.
// Limit: values of a file, after all aliases. At it: the file is refused. Seen: the error.
inline constexpr std::size_t kMaxValues = 100'000;

/// Builds the tree from a parser's events. It limits depth and number of values, so functions that
/// walk the tree may recurse. A duplicate key is an error, and its first value is kept; with
/// Rules::parameters all values are.
/// Thread safety: none.
/// Real-time: no.
class Builder {
 public:
  explicit Builder(Errors& errors, Rules rules = Rules::configuration)
      : errors_(errors), rules_(rules) {}

  /// Whether the next event must be a key.
  bool wants_key() const;
  void key(std::string name, int line);
  /// Opens a list or a map. All values are added to it until it is closed.
  void open(Value container);
  /// Closes the innermost container and returns it; valid until the next call.
  const Value& close();
  const Value& add(Value value);
  /// Counts values that are stored elsewhere (aliases) against the limit.
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
  const Rules rules_;
  std::vector<Value> open_;  // the open containers, the innermost last
  std::optional<Key> key_;   // of the next value
  std::size_t count_ = 0;
  Value root_;
};

/// Parses a text. Throws ConfigurationError with the first syntax error.
Value parse_yaml(const std::string& text, Errors& errors, Rules rules = Rules::configuration);
Value parse_json(std::string_view text, Errors& errors);

/// Replaces a value, or adds it to a map. Throws ConfigurationError, with the valid names, if the
/// path leads nowhere.
void set(Value& root, const Setting& setting, Errors& errors);

/// Throws ConfigurationError if the root has none of these keys, not even a mistyped one. The error
/// says nothing of what is in the file: it may be a list of passwords or a private key.
void check_is_ours(const Value& root, const std::vector<std::string>& keys, const Errors& errors);

/// Whether the file's name ends in .json; all other files are YAML.
bool is_json(std::string_view path);
/// Reads an untrusted file: any content gives a tree or a ConfigurationError in bounded time.
Value read(const std::string& path, Errors& errors, Rules rules = Rules::configuration);

}  // namespace document
}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_DOCUMENT_HPP_
