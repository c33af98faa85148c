// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/output.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"

namespace takt::rt {

void guard_output() noexcept {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // open() returns the lowest free descriptor. Opened read-only, it makes every write fail with
  // EBADF.
  for (int fd = 0; fd <= 2; ++fd) {
    if (fcntl(fd, F_GETFD) < 0) open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY);
  }
}

namespace {

bool has_colours(std::FILE* file) {
  const char* const no = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  const bool is_refused = no != nullptr && *no != '\0';
  const bool is_dumb = terminal == nullptr || std::string_view(terminal) == "dumb";
  return !is_refused && !is_dumb && isatty(fileno(file)) != 0;
}

struct Coloured {
  std::string_view begin, colour;
};
constexpr Coloured kColoured[] = {{"takt:", "\033[31m"}, {"note:", "\033[33m"}};

}  // namespace

void write(std::FILE* file, const std::string& text) {
  std::string escaped = printable(text, Lines::keep);
  for (const auto& [begin, colour] : kColoured) {
    if (!escaped.starts_with(begin) || !has_colours(file)) continue;
    escaped = fmt::format("{}{}\033[0m{}", colour, begin, escaped.substr(begin.size()));
    break;
  }
  std::fwrite(escaped.data(), 1, escaped.size(), file);
}

void show_line(std::string text) {
  winsize size{};
  const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  text = printable(text);
  if (is_known && text.size() >= size.ws_col) text.resize(size.ws_col - 1U);
  text.insert(0, "\r\033[K");
  std::fwrite(text.data(), 1, text.size(), stderr);
}

void clear_line() noexcept {
  std::fputs("\r\033[K", stderr);
}

void flush_output() {
  errno = 0;
  const bool is_flushed = std::fflush(stdout) == 0;
  if (is_flushed && std::ferror(stdout) == 0) return;
  throw std::runtime_error("the output could not be written" +
                           (errno != 0 ? ": " + errno_message(errno) : ""));
}

int checked_output(int status) noexcept {
  try {
    flush_output();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    status = status == 0 ? 1 : status;
  }
  return status == 0 && std::ferror(stderr) != 0 ? 1 : status;
}

}  // namespace takt::rt
