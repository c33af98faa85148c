// SPDX-License-Identifier: Apache-2.0
#include "takt/base/error.hpp"

#include <algorithm>
#include <numeric>
#include <system_error>
#include <utility>
#include <vector>

namespace takt {
namespace {

// Levenshtein's edit distance, one row at a time.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] != b[j] ? 1 : 0);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

std::string suggest(std::string_view name, std::span<const std::string> valid) {
  std::string result;
  const auto closest = std::min_element(
      valid.begin(), valid.end(),
      [&](const auto& a, const auto& b) { return distance(name, a) < distance(name, b); });
  // Beyond a third of the word it is a guess, and a wrong guess misleads.
  if (closest != valid.end() && distance(name, *closest) <= 1 + name.size() / 3) {
    result = "did you mean '" + *closest + "'? ";
  }
  result += "valid: ";
  for (std::size_t i = 0; i < valid.size(); ++i) result += (i == 0 ? "" : ", ") + valid[i];
  return result;
}

std::string errno_message(int error_number) {
  return std::generic_category().message(error_number);
}

}  // namespace takt
