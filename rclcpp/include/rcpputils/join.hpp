// Elements of a container in one text.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__JOIN_HPP_
#define RCPPUTILS__JOIN_HPP_

#include <sstream>
#include <string>

namespace rcpputils {

template <class Container>
std::string join(const Container& values, const char* delimiter) {
  std::ostringstream text;
  const char* between = "";
  for (const auto& value : values) {
    text << between << value;
    between = delimiter;
  }
  return text.str();
}

}  // namespace rcpputils

#endif  // RCPPUTILS__JOIN_HPP_
