// Keys of the configuration file that an executor or a scheduler brings, and their values.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_OWN_KEY_HPP_
#define TAKT_BASE_OWN_KEY_HPP_

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "takt/base/error.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A key, for the traits of what reads it. The file's errors list it.
struct OwnKey {
  std::string name, help;
};
bool has_key(const std::vector<OwnKey>& keys, std::string_view name) noexcept;

/// An error of a value, which knows the line of that value.
/// Thread safety: as Error. Real-time: no.
class OwnValueError : public Error {
 public:
  OwnValueError(int line, const std::string& what, const std::string& what_to_do)
      : Error(what, what_to_do), line_(line) {}
  int line() const noexcept { return line_; }  // 0: it is of no file

 private:
  int line_;
};

/// A value of the file, with those that it contains. The functions throw OwnValueError if it is
/// something else.
/// Thread safety: as a std::string.
/// Real-time: no; read it in a constructor.
struct OwnValue {
  std::string name;  // its key; in a list, "table[0]"
  int line = 0;
  std::variant<std::monostate, bool, std::int64_t, double, std::string> content = {};
  std::vector<OwnValue> values = {};  // of a list or a map
  enum class Kind : std::uint8_t { plain, list, map } kind = Kind::plain;

  bool as_bool() const;
  std::int64_t as_integer(std::int64_t least = std::numeric_limits<std::int64_t>::min(),
                          std::int64_t most = std::numeric_limits<std::int64_t>::max()) const;
  double as_number() const;
  const std::string& as_text() const;
  /// A number and its unit, `5ms`.
  Nanoseconds as_duration() const;
  const std::vector<OwnValue>& as_list() const;
  /// Of a map: the value of the key, nullptr if there is none.
  const OwnValue* find(std::string_view key) const;
  /// The same; a missing key is an error.
  const OwnValue& at(std::string_view key) const;
  /// Of a map: all other keys are errors.
  void allow_only(std::initializer_list<std::string_view> keys) const;
  [[noreturn]] void refuse(const std::string& what, const std::string& what_to_do = {}) const;
};

/// The values of the keys that are in the file.
using OwnValues = std::vector<OwnValue>;
/// nullptr: the key is not in the file.
const OwnValue* find(const OwnValues& values, std::string_view key);

}  // namespace takt

#endif  // TAKT_BASE_OWN_KEY_HPP_
