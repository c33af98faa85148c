// The exception of Takt's set-up functions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_ERROR_HPP_
#define TAKT_BASE_ERROR_HPP_

#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Says what is wrong, where, and what to do. The message is `where: what; what to do`.
/// Thread safety: as std::runtime_error.
/// Real-time: no; it allocates.
class Error : public std::runtime_error {
 public:
  Error(const std::string& what, const std::string& what_to_do = {}, const std::string& where = {});
};

/// Advice for an error about an unknown name: `did you mean 'x'? valid: a, b, c`.
std::string suggest(std::string_view name, std::span<const std::string> valid);

/// A text about a thrown object, for messages: what() of a std::exception.
std::string text_of(const std::exception_ptr& exception);

/// The message of errno, e.g. "Operation not permitted".
std::string errno_message(int error_number);

}  // namespace takt

#endif  // TAKT_BASE_ERROR_HPP_
