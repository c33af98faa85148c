// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/output.hpp"

#include <cerrno>
#include <csignal>
#include <stdexcept>

#include <fcntl.h>

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

void write(std::FILE* file, const std::string& text) {
  const std::string escaped = printable(text, Lines::keep);
  std::fwrite(escaped.data(), 1, escaped.size(), file);
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
