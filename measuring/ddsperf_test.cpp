// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/ddsperf.hpp"

#include <array>
#include <string>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

namespace takt::rt {
namespace {

constexpr const char* kCommand = "echo begun; sleep 600 & sleep 600; wait";

/// A pipe that the processes of a command have open until they end.
class HeldPipe {
 public:
  HeldPipe() { EXPECT_EQ(pipe(ends_.data()), 0); }
  ~HeldPipe() { close(ends_[0]); }
  HeldPipe(const HeldPipe&) = delete;
  HeldPipe& operator=(const HeldPipe&) = delete;

  /// Whether all others have ended, or do so soon.
  bool is_let_go() {
    close(ends_[1]);
    pollfd ended{ends_[0], 0, 0};
    return poll(&ended, 1, 30'000) == 1 && (ended.revents & POLLHUP) != 0;
  }

 private:
  std::array<int, 2> ends_{};
};

// A signal was heard only when the measurement was over, as long as that lasted.
TEST(ForEachLine, KillsTheCommandWhenItIsTold) {
  HeldPipe held;
  const int end = eventfd(0, EFD_CLOEXEC);
  std::string said;
  for_each_line(
      kCommand,
      [&](const std::string& line) {
        said = line;
        eventfd_write(end, 1);
      },
      end);
  EXPECT_EQ(said, "begun");
  EXPECT_TRUE(held.is_let_go());
  close(end);
}

TEST(ForEachLine, KillsTheCommandWhenTheProcessHasDied) {
  HeldPipe held;
  const pid_t child = fork();
  if (child == 0) {
    for_each_line(kCommand, [](const std::string&) { _exit(0); });
    _exit(1);
  }
  int status = 1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(held.is_let_go());
}

TEST(ForEachLine, ReadsAllLines) {
  std::string said;
  for_each_line("echo a & echo b; wait", [&](const std::string& line) { said += line; });
  EXPECT_EQ(said.size(), 2);
}

}  // namespace
}  // namespace takt::rt
