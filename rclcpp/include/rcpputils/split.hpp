// The parts of a text.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__SPLIT_HPP_
#define RCPPUTILS__SPLIT_HPP_

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace rcpputils {

/// Assigns each part to the insert iterator.
template <class Insert>
void split(const std::string& input, char delimiter, Insert& parts, bool skip_empty = false) {
  std::istringstream text(input);
  for (std::string part; std::getline(text, part, delimiter);) {
    if (!skip_empty || !part.empty()) parts = part;
  }
}
inline std::vector<std::string> split(const std::string& input, char delimiter,
                                      bool skip_empty = false) {
  std::vector<std::string> parts;
  auto end = std::back_inserter(parts);
  split(input, delimiter, end, skip_empty);
  return parts;
}

}  // namespace rcpputils

#endif  // RCPPUTILS__SPLIT_HPP_
