// SPDX-License-Identifier: Apache-2.0
#include "takt/base/error.hpp"

#include <algorithm>
#include <numeric>
#include <system_error>
#include <utility>
#include <vector>

#include "takt/base/printable.hpp"

namespace takt {

Error::Error(const std::string& what, const std::string& what_to_do, const std::string& where)
    : std::runtime_error(printable((where.empty() ? "" : where + ": ") + what +
                                       (what_to_do.empty() ? "" : "; " + what_to_do),
                                   Lines::keep)) {
}
namespace {

// Capitals count as small letters: INFO instead of info is one typing error, not four.
char small(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

// Levenshtein's edit distance, one row at a time; two swapped letters are one typing error.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    before = std::exchange(above, row);
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = above[j] + (small(a[i]) != small(b[j]) ? 1 : 0);
      row[j + 1] = std::min({row[j] + 1, above[j + 1] + 1, substituted});
      const bool are_swapped =
          i > 0 && j > 0 && small(a[i]) == small(b[j - 1]) && small(a[i - 1]) == small(b[j]);
      if (are_swapped) row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
    }
  }
  return row.back();
}

// A longer name is not a typing error, and a comparison costs the product of the lengths.
constexpr std::size_t kLongest = 100;

// The valid word that the user meant; nullptr if unsure, as a wrong guess misleads.
const std::string* meant(std::string_view name, std::span<const std::string> valid) {
  if (name.size() > kLongest) return nullptr;
  constexpr std::size_t kShortestBeginning = 3;  // "prio" abbreviates one word only
  const auto begins = [&](const std::string& word) { return word.starts_with(name); };
  if (name.size() >= kShortestBeginning && std::count_if(valid.begin(), valid.end(), begins) == 1) {
    return &*std::find_if(valid.begin(), valid.end(), begins);
  }
  const std::string* closest = nullptr;
  std::size_t bound = 2 + name.size() / 3;  // a third of the word and one letter may be wrong
  for (const std::string& word : valid) {
    const auto [shorter, longer] = std::minmax({name.size(), word.size()});
    if (longer - shorter >= bound) continue;  // the distance is at least the difference in length
    const std::size_t away = distance(name, word);
    if (away >= bound) continue;
    bound = away;
    closest = &word;
  }
  return closest;
}

// A long list is hard to search: it is cut to the words nearest to the name, in the order of the
// list.
std::vector<std::string> shown_of(std::string_view name, std::span<const std::string> valid) {
  // Limit: valid names in an error. At it: the nearest ones are shown. Seen: "others are" in the
  // error.
  constexpr std::size_t kMost = 30;
  std::vector<std::string> shown(valid.begin(), valid.end());
  if (shown.size() <= kMost) return shown;
  std::vector<std::pair<std::size_t, std::size_t>> order;  // distance to the name, and position
  for (std::size_t i = 0; i < valid.size(); ++i) {
    const bool is_comparable = name.size() <= kLongest && valid[i].size() <= kLongest;
    order.emplace_back(is_comparable ? distance(name, valid[i]) : kLongest, i);
  }
  std::sort(order.begin(), order.end());
  order.resize(kMost);
  std::sort(order.begin(), order.end(),
            [](const auto& a, const auto& b) { return a.second < b.second; });
  shown.clear();
  for (const auto& [away, place] : order) shown.push_back(valid[place]);
  return shown;
}

}  // namespace

std::string suggest(std::string_view name, std::span<const std::string> valid) {
  if (valid.empty()) return "there are none";
  std::string result;
  if (const std::string* word = meant(name, valid)) result = "did you mean '" + *word + "'? ";
  result += "valid: ";
  const std::vector<std::string> shown = shown_of(name, valid);
  for (std::size_t i = 0; i < shown.size(); ++i) result += (i == 0 ? "" : ", ") + shown[i];
  if (const std::size_t rest = valid.size() - shown.size(); rest != 0) {
    result += ", and " + std::to_string(rest) + " more";
  }
  return result;
}

std::string text_of(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an object that is not a std::exception";
  }
}

std::string errno_message(int error_number) {
  return std::generic_category().message(error_number);
}

}  // namespace takt
