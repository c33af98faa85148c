// A program whose output cannot be written has failed, and says so.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_OUTPUT_HPP_
#define TAKT_MEASURING_OUTPUT_HPP_

#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace takt::rt {

/// At the beginning of main: a pipe without a reader, and a closed descriptor, become errors of
/// writing. Without it the first ends the process, and the second lets the next file that is opened
/// get what is printed.
void guard_output() noexcept;

/// Writes what stdout still holds. Throws std::runtime_error when that, or what was printed before,
/// could not be written.
void flush_output();

/// At the end of main: the exit status, which is 1 instead of 0 when something that was printed to
/// stdout or stderr could not be written.
int checked_output(int status) noexcept;

/// To stderr. Unlike fmt::print it does not throw: an error must not prevent its own report.
template <class... Args>
void to_stderr(fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace takt::rt

#endif  // TAKT_MEASURING_OUTPUT_HPP_
