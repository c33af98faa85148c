// SPDX-License-Identifier: Apache-2.0
#include "run/child_output.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "run/progress.hpp"

namespace takt::tools {

std::size_t most_in(int pipe) noexcept {
  const int bytes = fcntl(pipe, F_GETPIPE_SZ);
  return bytes > 0 ? static_cast<std::size_t>(bytes) : 0;
}

ChildOutput::ChildOutput(pid_t child, int pipe)
    : pipe_(pipe), process_(static_cast<int>(syscall(SYS_pidfd_open, child, 0))) {
  fcntl(pipe_, F_SETFL, O_NONBLOCK);
}

ChildOutput::~ChildOutput() {
  close(pipe_);
  close(process_);
}

bool ChildOutput::wait(Nanoseconds most, int other) {
  std::array<pollfd, 3> events{{{pipe_, POLLIN, 0}, {process_, POLLIN, 0}, {other, POLLIN, 0}}};
  const timespec time = to_timespec(most);
  ppoll(events.data(), events.size(), &time, nullptr);
  if (events[1].revents != 0) {
    const std::size_t end = text_.size() + most_in(pipe_);
    while (text_.size() < end && read_some()) {
    }
    return false;
  }
  // When the pipe has ended, and the child has not, there is nothing but its end to wait for.
  if (events[0].revents != 0 && !read_some()) {
    ppoll(events.data() + 1, 2, &time, nullptr);
  }
  return true;
}

bool ChildOutput::read_some() {
  std::array<char, 65536> buffer;
  const ssize_t size = read(pipe_, buffer.data(), buffer.size());
  if (size > 0) text_.append(buffer.data(), static_cast<std::size_t>(size));
  return size > 0 || (size < 0 && errno == EINTR);
}

}  // namespace takt::tools
