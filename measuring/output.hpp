// Makes a program fail if its output cannot be written.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_OUTPUT_HPP_
#define TAKT_MEASURING_OUTPUT_HPP_

#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace takt::rt {

/// Call it at the beginning of main(). A pipe without a reader, a file at its limit of size and a
/// closed descriptor then become write errors. Otherwise, the first two would end the process by
/// SIGPIPE and SIGXFSZ, and with the third the output would go to the next opened file.
void guard_output() noexcept;

/// Flushes stdout. Throws std::runtime_error if this or an earlier write failed.
void flush_output();

/// Call it at the end of main(). Returns the exit status: 1 instead of 0 if output to stdout or
/// stderr could not be written.
int checked_output(int status) noexcept;

/// Escapes and prints. Unlike fmt::print it does not throw: error reports must not fail. On a
/// terminal, the "takt:" and "note:" that begin a line have a colour, unless NO_COLOR is set.
void write(std::FILE* file, const std::string& text);

/// Prints to stdout. Texts of other processes may be in it: control characters are escaped, except
/// line breaks and tabs.
template <class... Args>
void print(fmt::format_string<Args...> format, Args&&... args) {
  write(stdout, fmt::format(format, std::forward<Args>(args)...));
}

/// Prints to stderr, as print() does.
template <class... Args>
void to_stderr(fmt::format_string<Args...> format, Args&&... args) {
  write(stderr, fmt::format(format, std::forward<Args>(args)...));
}

/// Clears the line of stderr's terminal, and goes to its beginning.
void clear_line() noexcept;
/// Replaces that line, by as much of the text as fits into it.
void show_line(std::string text);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_OUTPUT_HPP_
