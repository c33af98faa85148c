// Checks that throw.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__ASSERTS_HPP_
#define RCPPUTILS__ASSERTS_HPP_

#include <stdexcept>
#include <string>

namespace rcpputils {

class AssertionException : public std::logic_error {
 public:
  using logic_error::logic_error;
};
class IllegalStateException : public std::logic_error {
 public:
  using logic_error::logic_error;
};

/// Throws std::invalid_argument unless it is true.
inline void require_true(bool is_true, const std::string& message = "invalid argument passed") {
  if (!is_true) throw std::invalid_argument(message);
}
/// Throws IllegalStateException unless it is true.
inline void check_true(bool is_true, const std::string& message = "check reported invalid state") {
  if (!is_true) throw IllegalStateException(message);
}
/// Throws AssertionException unless it is true; nothing with NDEBUG.
inline void assert_true([[maybe_unused]] bool is_true,
                        [[maybe_unused]] const std::string& message = "assertion failed") {
#ifndef NDEBUG
  if (!is_true) throw AssertionException(message);
#endif
}

}  // namespace rcpputils

#endif  // RCPPUTILS__ASSERTS_HPP_
