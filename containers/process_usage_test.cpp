// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/process_usage.hpp"

#include <array>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/clock.hpp"

namespace takt::process_usage_test {
namespace {

using namespace std::chrono_literals;

/// A child process, until the end of the scope.
class Child {
 public:
  Child() {
    if (pipe(ends_.data()) != 0) std::abort();
    pid_ = fork();
    if (pid_ != 0) return;
    close(ends_[1]);
    std::byte nothing{};
    [[maybe_unused]] const ssize_t ended = ::read(ends_[0], &nothing, 1);
    _exit(0);
  }
  ~Child() {
    close(ends_[1]);
    waitpid(pid_, nullptr, 0);
    close(ends_[0]);
  }
  pid_t pid() const { return pid_; }

 private:
  std::array<int, 2> ends_{};
  pid_t pid_ = 0;
};

// RSS in its place passed all tests.
TEST(ProcessUsage, OfMemoryThatTwoProcessesShareEachHasHalf) {
  constexpr std::size_t kMegabytes = 64;
  const std::vector<std::byte> memory(kMegabytes << 20, std::byte{1});
  const std::uint64_t before = proportional_set_size_kb();
  EXPECT_GT(before, (kMegabytes << 10) - 1024);
  const Child child;
  EXPECT_LT(proportional_set_size_kb(), before - (kMegabytes << 10) / 4);
  EXPECT_LT(proportional_set_size_kb(child.pid()), before - (kMegabytes << 10) / 4);
  EXPECT_GT(proportional_set_size_kb(child.pid()), (kMegabytes << 10) / 4);
}

TEST(ProcessUsage, KnowsWhatAThreadHasUsed) {
  const Nanoseconds before = process_cpu_time();
  burn_cpu(50ms);
  EXPECT_GE(process_cpu_time() - before, 49ms);
  EXPECT_GE(process_cpu_time(getpid()), 49ms);
}

}  // namespace
}  // namespace takt::process_usage_test
