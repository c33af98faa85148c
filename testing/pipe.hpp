// A pipe for tests of what waits for file descriptors.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_PIPE_HPP_
#define TAKT_TESTING_PIPE_HPP_

#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace takt {

/// A pipe that neither end blocks on.
class Pipe {
 public:
  Pipe() { EXPECT_EQ(pipe2(ends_, O_NONBLOCK | O_CLOEXEC), 0); }
  ~Pipe() {
    close(ends_[0]);
    close_writer();
  }
  int reader() const { return ends_[0]; }
  void close_writer() {
    if (ends_[1] >= 0) close(std::exchange(ends_[1], -1));
  }
  void send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t size = write(ends_[1], text.data(), text.size());
      if (size > 0) {
        text.remove_prefix(static_cast<std::size_t>(size));
      } else {
        std::this_thread::yield();  // it is full
      }
    }
  }
  std::string receive(std::size_t most) const {
    std::string text(most, ' ');
    const ssize_t size = read(ends_[0], text.data(), most);
    text.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return text;
  }

 private:
  int ends_[2] = {-1, -1};
};

}  // namespace takt

#endif  // TAKT_TESTING_PIPE_HPP_
