// Tests of the counters of what a real-time thread should not do.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/realtime_scope.hpp"

#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace takt {
namespace {

constexpr const char* kNotCounted = "a sanitizer has taken malloc over";

// Volatile, so that the compiler does not remove what is allocated for nothing.
void* volatile sink;

TEST(RealtimeScope, CountsNothingWhereNothingHappens) {
  const RealtimeScope scope;
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

// The story: the compiler, which believes that it knows malloc, once made this a constant `false`,
// and every test of allocations was silently skipped.
TEST(RealtimeScope, CountsInProgramsThatLinkTheCounterUnlessASanitizerHasMalloc) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  EXPECT_FALSE(allocations_are_counted());
#else
  EXPECT_TRUE(allocations_are_counted());
#endif
}

TEST(RealtimeScope, CountsEveryKindOfAllocation) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  const RealtimeScope scope;
  sink = std::malloc(10);
  EXPECT_EQ(scope.so_far().allocations, 1u);
  sink = std::realloc(sink, 1000);
  EXPECT_EQ(scope.so_far().allocations, 2u);
  std::free(sink);
  sink = std::calloc(3, 10);
  EXPECT_EQ(scope.so_far().allocations, 3u);
  std::free(sink);
  sink = std::aligned_alloc(64, 128);
  EXPECT_EQ(scope.so_far().allocations, 4u);
  std::free(sink);
  void* block = nullptr;
  EXPECT_EQ(posix_memalign(&block, 64, 128), 0);
  EXPECT_EQ(scope.so_far().allocations, 5u);
  std::free(block);
  const auto object = std::make_unique<std::vector<int>>(3);
  EXPECT_EQ(scope.so_far().allocations, 7u);  // the vector and its elements
}

TEST(RealtimeScope, CountsNoFreeing) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  sink = std::malloc(10);
  const RealtimeScope scope;
  std::free(sink);
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST(RealtimeScope, CountsOnlyWhatItsOwnThreadAllocates) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  std::uint64_t of_thread = 0;
  std::thread other;
  const RealtimeScope scope;
  other = std::thread([&] {
    const RealtimeScope inner;
    for (int i = 0; i < 1000; ++i) {
      sink = std::malloc(10);
      std::free(sink);
    }
    of_thread = inner.so_far().allocations;
  });
  other.join();
  EXPECT_EQ(of_thread, 1000u);
  EXPECT_LT(scope.so_far().allocations, 1000u);  // starting the thread costs a few
}

TEST(RealtimeScope, CountsTheFirstTouchOfAPage) {
  constexpr std::size_t kPages = 8;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* const memory =
      mmap(nullptr, kPages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  ASSERT_EQ(madvise(memory, kPages * page, MADV_NOHUGEPAGE), 0);
  const RealtimeScope scope;
  for (std::size_t i = 0; i < kPages; ++i) static_cast<volatile char*>(memory)[i * page] = 1;
  const std::uint64_t faults = scope.so_far().minor_faults;
  EXPECT_GE(faults, kPages);
  EXPECT_LT(faults, 2 * kPages);  // the loop itself may touch another
  munmap(memory, kPages * page);
}

TEST(ForeignCode, IsCountedApart) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const RealtimeScope scope;
  {
    const ForeignCode library;
    ::operator delete(::operator new(10));
  }
  ::operator delete(::operator new(10));
  const ThreadCounters counters = scope.so_far();
  EXPECT_EQ(counters.allocations, 1u);
  EXPECT_EQ(counters.foreign_allocations, 1u);
}

TEST(ThreadCounters, SubtractFieldByField) {
  const ThreadCounters later{10, 20, 30, 40, 50, 60};
  const ThreadCounters earlier{1, 2, 3, 4, 5, 6};
  const ThreadCounters difference = later - earlier;
  EXPECT_EQ(difference.allocations, 9u);
  EXPECT_EQ(difference.foreign_allocations, 18u);
  EXPECT_EQ(difference.minor_faults, 27u);
  EXPECT_EQ(difference.major_faults, 36u);
  EXPECT_EQ(difference.voluntary_switches, 45u);
  EXPECT_EQ(difference.involuntary_switches, 54u);
}

}  // namespace
}  // namespace takt
