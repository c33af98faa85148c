// Aligned columns for people.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TABLE_HPP_
#define TAKT_TOOLS_TAKT_TABLE_HPP_

#include <string>
#include <vector>

#include "takt/base/time.hpp"

namespace takt::tools {

/// Words stand left, numbers (cells that begin with a digit, '-' or '.') right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  /// To stdout, under a title; nothing when there are no rows.
  void print(const std::string& title) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A duration in µs with as many digits as matter: "0.85", "12.3", "1042".
std::string microseconds(Nanoseconds duration);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TABLE_HPP_
