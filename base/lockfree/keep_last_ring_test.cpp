// Tests of the ring that keeps the newest items.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/keep_last_ring.hpp"

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

// A ring of numbers that are never freed while it lives, for readable expectations.
class NumberRing {
 public:
  explicit NumberRing(std::size_t depth, std::size_t numbers = 100)
      : ring_(depth), numbers_(numbers) {
    for (std::size_t i = 0; i < numbers; ++i) numbers_[i] = static_cast<int>(i);
  }
  /// The number that had to make room, or -1.
  int push(int number) {
    const int* old =
        ring_.push(&numbers_[static_cast<std::size_t>(number)],
                   static_cast<std::uint64_t>(number) + 1000, number + 2000, number + 3000);
    return old == nullptr ? -1 : *old;
  }
  int push_here(int number) {
    const int* old =
        ring_.push_here(&numbers_[static_cast<std::size_t>(number)],
                        static_cast<std::uint64_t>(number) + 1000, number + 2000, number + 3000);
    return old == nullptr ? -1 : *old;
  }
  int pop() {
    const int* number = ring_.pop([this](int*) { ++dropped_while_popping_; }, more_);
    return number == nullptr ? -1 : *number;
  }
  std::vector<int> drain() {
    std::vector<int> result;
    for (int number; (number = pop()) != -1;) result.push_back(number);
    return result;
  }
  /// The number that `front` reports, or -1.
  int front() const {
    std::uint64_t sequence = 0;
    std::int64_t time_ns = 0, root_time_ns = 0;
    if (!ring_.front(sequence, time_ns, root_time_ns)) return -1;
    EXPECT_EQ(time_ns, static_cast<std::int64_t>(sequence) + 1000);
    EXPECT_EQ(root_time_ns, time_ns + 1000);
    return static_cast<int>(sequence) - 1000;
  }
  std::size_t size() const { return ring_.size(); }
  std::uint64_t pushed() const { return ring_.pushed(); }
  /// The result of the last pop.
  bool more() const { return more_; }
  int dropped_while_popping() const { return dropped_while_popping_; }

 private:
  KeepLastRing<int> ring_;
  std::vector<int> numbers_;
  int dropped_while_popping_ = 0;
  bool more_ = false;
};

TEST(KeepLastRing, IsEmptyAtFirst) {
  NumberRing ring(4);
  EXPECT_EQ(ring.pop(), -1);
  EXPECT_EQ(ring.front(), -1);
  EXPECT_EQ(ring.size(), 0u);
}

TEST(KeepLastRing, GivesItemsInOrderOfArrival) {
  NumberRing ring(4);
  for (const int number : {7, 5, 9}) EXPECT_EQ(ring.push(number), -1);
  EXPECT_EQ(ring.size(), 3u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{7, 5, 9}));
  EXPECT_EQ(ring.size(), 0u);
}

TEST(KeepLastRing, GivesBackTheOldestWhenFull) {
  NumberRing ring(2);
  EXPECT_EQ(ring.push(1), -1);
  EXPECT_EQ(ring.push(2), -1);
  EXPECT_EQ(ring.push(3), 1);
  EXPECT_EQ(ring.push(4), 2);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
}

TEST(KeepLastRing, HasRoomAgainAfterPop) {
  NumberRing ring(2);
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.pop(), 1);
  EXPECT_EQ(ring.push(3), -1);
  EXPECT_EQ(ring.push(4), 2);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
}

TEST(KeepLastRing, ReturnsWithAnItemWhetherThereAreMore) {
  NumberRing ring(3);
  ring.pop();
  EXPECT_FALSE(ring.more());
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.pop(), 1);
  EXPECT_TRUE(ring.more());
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_FALSE(ring.more());
}

TEST(KeepLastRing, CountsAllThatWasPushed) {
  NumberRing ring(2);
  EXPECT_EQ(ring.pushed(), 0u);
  for (int number = 0; number < 5; ++number) ring.push(number);
  EXPECT_EQ(ring.pushed(), 5u);
  ring.drain();
  EXPECT_EQ(ring.pushed(), 5u);
}

TEST(KeepLastRing, OfDepthOneKeepsTheNewestOnly) {
  NumberRing ring(1);
  EXPECT_EQ(ring.push(1), -1);
  EXPECT_EQ(ring.push(2), 1);
  EXPECT_EQ(ring.front(), 2);
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_EQ(ring.push(3), -1);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3}));
}

TEST(KeepLastRing, ReadsTheOldestWithoutTakingIt) {
  NumberRing ring(2);
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.front(), 1);
  EXPECT_EQ(ring.front(), 1);
  ring.push(3);
  EXPECT_EQ(ring.front(), 2);
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_EQ(ring.front(), 3);
  EXPECT_EQ(ring.pop(), 3);
  EXPECT_EQ(ring.front(), -1);
}

TEST(KeepLastRing, KeepsOrderAndDepthWithItemsOfItsTakersThread) {
  NumberRing ring(2);
  EXPECT_EQ(ring.push_here(1), -1);
  EXPECT_EQ(ring.front(), 1);
  EXPECT_EQ(ring.push_here(2), -1);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.push(3), 1);
  EXPECT_EQ(ring.push_here(4), 2);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
  EXPECT_EQ(ring.push_here(5), -1);
  EXPECT_EQ(ring.pop(), 5);
  EXPECT_FALSE(ring.more());
  EXPECT_EQ(ring.push_here(6), -1);
  EXPECT_EQ(ring.push(7), -1);
  EXPECT_EQ(ring.pop(), 6);
  EXPECT_TRUE(ring.more());
  EXPECT_EQ(ring.drain(), std::vector<int>{7});
  EXPECT_EQ(ring.pushed(), 7u);
}

// Every depth against a plain model; 70000 tickets, so that the 16 bits in a cell wrap.
TEST(KeepLastRing, BehavesLikeABoundedQueueAtAnyDepthAndBeyondTheTicketWrap) {
  for (const std::size_t depth : {1u, 2u, 3u, 5u, 7u, 10u, 64u, 100u, 1000u}) {
    constexpr int kPushes = 70'000;
    NumberRing ring(depth, kPushes);
    std::mt19937 random(static_cast<unsigned>(depth));
    int oldest = 0;  // the model holds [oldest, next)
    for (int next = 0; next < kPushes;) {
      const int held = next - oldest;
      if (random() % 5 < 3) {
        const int old = random() % 2 == 0 ? ring.push(next) : ring.push_here(next);
        ASSERT_EQ(old, held == static_cast<int>(depth) ? oldest : -1) << depth;
        if (held == static_cast<int>(depth)) ++oldest;
        ++next;
      } else {
        ASSERT_EQ(ring.front(), held == 0 ? -1 : oldest) << depth;
        ASSERT_EQ(ring.pop(), held == 0 ? -1 : oldest) << depth;
        if (held != 0) ++oldest;
      }
      ASSERT_EQ(ring.size(), static_cast<std::size_t>(next - oldest)) << depth;
    }
    EXPECT_EQ(ring.dropped_while_popping(), 0);
  }
}

TEST(KeepLastRing, HoldsItsGreatestDepth) {
  constexpr int kDepth = KeepLastRing<int>::kMaxDepth;
  NumberRing ring(kDepth, 5 * kDepth);  // more than 65536 tickets
  for (int number = 0; number < 5 * kDepth; ++number) {
    ASSERT_EQ(ring.push(number), number < kDepth ? -1 : number - kDepth);
  }
  EXPECT_EQ(ring.size(), std::size_t{kDepth});
  for (int number = 4 * kDepth; number < 5 * kDepth; ++number) ASSERT_EQ(ring.pop(), number);
  EXPECT_EQ(ring.pop(), -1);
}

TEST(KeepLastRing, PushesAndPopsWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  NumberRing ring(3);
  const RealtimeScope scope;
  for (int number = 0; number < 10; ++number) ring.push(number);
  const int first = ring.pop();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(first, 7);
}

}  // namespace
}  // namespace takt
