// The exit statuses of all commands: one status says one thing.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_EXIT_STATUS_HPP_
#define TAKT_TOOLS_TAKT_EXIT_STATUS_HPP_

#include <stdexcept>
#include <string>

#include "takt/base/error.hpp"

namespace takt::tools {

inline constexpr int kFailed = 1;    // the command ran, and something failed
inline constexpr int kBadUsage = 2;  // its words, or a file that it reads or writes

/// About the words of the command, also if that turns out later: kBadUsage.
class UsageError : public Error {
 public:
  using Error::Error;
};
/// Makes what reads a file that was named: its errors are about the words.
template <class Function>
auto as_usage(Function&& function) {
  try {
    return function();
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
}

/// The command's words and files are right, and it begins: an Error from now on is kFailed.
void begin_work();
/// For an Error that is about neither the words nor a line of a file.
int status_of_error() noexcept;

/// Its text, with what to do where that says it only in the kernel's words.
std::string message_of(const std::exception& error);

/// Message for an exception that has no what().
inline constexpr const char* kNoStdException =
    "a callback threw an object that is not a std::exception";

/// A signal has ended something before it was complete. main() returns 128 and the signal.
class Interrupted : public std::runtime_error {
 public:
  Interrupted(int signal, const std::string& when);
  const int signal;
};
/// Throws Interrupted if the signal (0: none) has ended what would have ended by itself.
void check_complete(int signal, bool ends_by_itself);

/// docs/reference/exit_status.md.
std::string exit_status_page();

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_EXIT_STATUS_HPP_
