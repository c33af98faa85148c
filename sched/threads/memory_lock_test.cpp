// Tests of locked memory.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/memory_lock.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
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

}  // namespace
}  // namespace takt
