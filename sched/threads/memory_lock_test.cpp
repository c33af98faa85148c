// Tests of locked memory.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/memory_lock.hpp"

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/testing/child_process.hpp"

namespace takt {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLocksNothing = true;
#else
constexpr bool kLocksNothing = false;
#endif
constexpr const char* kSanitizer = "sanitizers make mlockall do nothing";

long locked_kilobytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmLck:")) return std::stol(line.substr(6));
  }
  return -1;
}

// Locking is for the whole process, so each test locks in a child and reads what it says.
TEST(LockMemory, DoesNothingWhenRealtimeIsOff) {
  EXPECT_EQ(
      in_child(Rights::none,
               [] { return lock_memory(Realtime::off) + std::to_string(locked_kilobytes()); }),
      "0");
}

TEST(LockMemory, LocksWhatTheProcessHasAndWillHave) {
  if (kLocksNothing) GTEST_SKIP() << kSanitizer;
  const std::string text = in_child(Rights::as_they_are, [] {
    const std::string refused = lock_memory(Realtime::prefer);
    if (!refused.empty()) return refused;
    const long before = locked_kilobytes();
    const std::string later(8 << 20, 'x');
    const bool grew = locked_kilobytes() >= before + (8 << 10);
    return std::string(before > 0 && grew ? "locked" : "not locked");
  });
  if (text.starts_with("memory lock: ")) GTEST_SKIP() << text;
  EXPECT_EQ(text, "locked");
}

TEST(LockMemory, ReportsWhyItWasRefusedWhenPreferred) {
  if (kLocksNothing) GTEST_SKIP() << kSanitizer;
  const std::string text = in_child(Rights::none, [] { return lock_memory(Realtime::prefer); });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("memory lock: "));
  EXPECT_THAT(text, HasSubstr("RLIMIT_MEMLOCK is 0 bytes; give the user memlock"));
}

TEST(LockMemory, ThrowsWhenRequiredAndRefused) {
  if (kLocksNothing) GTEST_SKIP() << kSanitizer;
  const std::string text = in_child(Rights::none, [] {
    try {
      return "no error: " + lock_memory(Realtime::require);
    } catch (const Error& error) {
      return std::string(error.what());
    }
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("memory lock: "));
  EXPECT_THAT(text, HasSubstr("grant it, or write `realtime: prefer` to go on without"));
}

[[gnu::noinline]] void use_stack() {
  volatile std::byte stack[128 * 1024];
  for (std::size_t offset = 0; offset < sizeof(stack); offset += 1024) stack[offset] = std::byte{1};
}

// The compiler had left out what touched it, so the first deep call of a callback met page faults.
TEST(PrefaultStack, SparesTheThreadPageFaults) {
  if (kLocksNothing) GTEST_SKIP() << "sanitizers have stacks of their own";
  const auto faults_of_first_use = [](bool prefaulted) {
    std::uint64_t faults = 0;
    std::thread([&] {
      if (prefaulted) prefault_stack();
      const RealtimeScope scope;
      use_stack();
      faults = scope.so_far().minor_faults;
    }).join();
    return faults;
  };
  if (faults_of_first_use(false) < 10) GTEST_SKIP() << "the kernel gives stacks many pages at once";
  EXPECT_LT(faults_of_first_use(true), 3u);
}

}  // namespace
}  // namespace takt
