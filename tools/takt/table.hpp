// Prints tables with aligned columns.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TABLE_HPP_
#define TAKT_TOOLS_TAKT_TABLE_HPP_

#include <string>
#include <vector>

#include "takt/base/time.hpp"

namespace takt::tools {

/// Text is left-aligned; numbers (cells that begin with a digit, '-' or '.') are right-aligned.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  /// Names of other processes may be in it: see printable().
  void add(std::vector<std::string> row);
  /// Prints to stdout, with a title; prints nothing if there are no rows.
  void print(const std::string& title) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Formats a duration in µs with about three significant digits: "0.85", "12.3", "1042".
std::string microseconds(Nanoseconds duration);
/// Formats a duration in ms, to the microsecond: "12.345".
std::string milliseconds(Nanoseconds duration);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TABLE_HPP_
