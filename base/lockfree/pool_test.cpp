// Tests of the pool whose objects are lent and come back.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/pool.hpp"

#include <atomic>
#include <cstdint>
#include <latch>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/lockfree/inbox.hpp"
#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

struct Tool : PoolNode<Tool> {
  Tool(std::uint32_t tool_number, std::atomic<int>& alive_count)
      : number(tool_number), alive(alive_count) {
    alive.fetch_add(1);
  }
  ~Tool() { alive.fetch_sub(1); }

  const std::uint32_t number;
  std::atomic<int>& alive;
  std::atomic<bool> is_lent{false};
  int wear = 0;  // not atomic: the pool orders one borrower after another
  Tool* inbox_next = nullptr;
};

class PoolTest : public testing::Test {
 protected:
  PoolPtr<Tool> make_pool(std::size_t capacity, std::size_t at_once = SIZE_MAX) {
    return PoolPtr<Tool>(Pool<Tool>::create(
        capacity, [this](void* place, std::uint32_t i) { new (place) Tool(i, alive_); }, at_once));
  }
  /// Closed pools are looked through when another is made or closed, so that bringing an object
  /// home never frees anything.
  static void make_and_close_another_pool() {
    std::atomic<int> ignored{0};
    PoolPtr<Tool>(Pool<Tool>::create(
        0, [&](void* place, std::uint32_t i) { new (place) Tool(i, ignored); }, 0));
  }
  static std::vector<Tool*> borrow_all(Pool<Tool>& pool) {
    std::vector<Tool*> tools;
    while (Tool* tool = pool.acquire()) tools.push_back(tool);
    return tools;
  }

  std::atomic<int> alive_{0};
};

TEST_F(PoolTest, MakesAllObjectsAtOnceAndDestroysThemWithTheOwner) {
  PoolPtr<Tool> pool = make_pool(3);
  EXPECT_EQ(pool->capacity(), 3u);
  EXPECT_EQ(alive_, 3);
  pool.reset();
  EXPECT_EQ(alive_, 0);
}

// A pool for a thousand messages took the memory of a thousand, though two were out at once.
TEST_F(PoolTest, MakesNoMoreObjectsThanAreOutAtOnce) {
  PoolPtr<Tool> pool = make_pool(1000, /*at_once=*/1);
  EXPECT_EQ(alive_, 1);
  for (int i = 0; i < 10; ++i) {
    Tool* const first = pool->acquire();
    Tool* const second = pool->acquire();
    EXPECT_NE(first, second);
    Pool<Tool>::recycle(*first);
    Pool<Tool>::recycle(*second);
  }
  EXPECT_EQ(alive_, 2);
  EXPECT_EQ(pool->made(), 2u);
  const std::vector<Tool*> tools = borrow_all(*pool);
  EXPECT_EQ(tools.size(), 1000u);
  EXPECT_EQ((std::set<Tool*>(tools.begin(), tools.end()).size()), 1000u);
  EXPECT_EQ(alive_, 1000);
  for (Tool* tool : tools) Pool<Tool>::recycle(*tool);
  pool.reset();
  EXPECT_EQ(alive_, 0);
}

TEST_F(PoolTest, ThrowsWhatMakingAnObjectThrows) {
  const auto make = [this](void* place, std::uint32_t number) {
    if (number == 2) throw std::bad_alloc();
    new (place) Tool(number, alive_);
  };
  EXPECT_THROW(Pool<Tool>::create(3, make, 3), std::bad_alloc);
  make_and_close_another_pool();
  EXPECT_EQ(alive_, 0);
}

TEST_F(PoolTest, LendsEachObjectOnceAndThenNothing) {
  const PoolPtr<Tool> pool = make_pool(3);
  const std::vector<Tool*> tools = borrow_all(*pool);
  EXPECT_EQ((std::set<Tool*>(tools.begin(), tools.end()).size()), 3u);
  EXPECT_EQ(tools.size(), 3u);
  EXPECT_EQ(pool->acquire(), nullptr);
  for (Tool* tool : tools) Pool<Tool>::recycle(*tool);
}

TEST_F(PoolTest, LendsAgainWhatCameBack) {
  const PoolPtr<Tool> pool = make_pool(3);
  const std::vector<Tool*> tools = borrow_all(*pool);
  Pool<Tool>::recycle(*tools[1]);
  EXPECT_EQ(pool->acquire(), tools[1]);
  EXPECT_EQ(pool->acquire(), nullptr);
  for (Tool* tool : tools) Pool<Tool>::recycle(*tool);
  EXPECT_EQ(borrow_all(*pool).size(), 3u);
  for (Tool* tool : tools) Pool<Tool>::recycle(*tool);
}

TEST_F(PoolTest, KeepsObjectsAsTheyWereReturned) {
  const PoolPtr<Tool> pool = make_pool(1);
  Tool* tool = pool->acquire();
  tool->wear = 5;
  Pool<Tool>::recycle(*tool);
  tool = pool->acquire();
  EXPECT_EQ(tool->wear, 5);
  Pool<Tool>::recycle(*tool);
}

TEST_F(PoolTest, MayHaveNoObjectsAtAll) {
  PoolPtr<Tool> pool = make_pool(0);
  EXPECT_EQ(pool->capacity(), 0u);
  EXPECT_EQ(pool->acquire(), nullptr);
  pool.reset();
  EXPECT_EQ(alive_, 0);
}

TEST_F(PoolTest, LivesUntilTheLastObjectIsHomeWhenTheOwnerGoesFirst) {
  PoolPtr<Tool> pool = make_pool(4);
  Tool* first = pool->acquire();
  Tool* second = pool->acquire();
  Pool<Tool>::recycle(*pool->acquire());
  pool.reset();
  EXPECT_EQ(alive_, 4);
  first->wear = 1;  // still ours
  Pool<Tool>::recycle(*first);
  make_and_close_another_pool();
  EXPECT_EQ(alive_, 4);
  second->wear = 1;
  Pool<Tool>::recycle(*second);
  EXPECT_EQ(alive_, 4);
  make_and_close_another_pool();
  EXPECT_EQ(alive_, 0);
}

TEST_F(PoolTest, LivesUntilTheLastObjectIsHomeWhenAllAreOut) {
  PoolPtr<Tool> pool = make_pool(2);
  const std::vector<Tool*> tools = borrow_all(*pool);
  pool.reset();
  Pool<Tool>::recycle(*tools[0]);
  make_and_close_another_pool();
  EXPECT_EQ(alive_, 2);
  Pool<Tool>::recycle(*tools[1]);
  make_and_close_another_pool();
  EXPECT_EQ(alive_, 0);
}

TEST_F(PoolTest, LendsAndTakesBackWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const PoolPtr<Tool> pool = make_pool(3);
  const RealtimeScope scope;
  for (int i = 0; i < 10; ++i) {
    Tool* first = pool->acquire();
    Tool* second = pool->acquire();
    Pool<Tool>::recycle(*first);
    Pool<Tool>::recycle(*second);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST_F(PoolTest, NeverLendsAnObjectToTwoThreadsAtOnce) {
  constexpr int kThreads = 4;
  constexpr int kRounds = 10'000;
  const PoolPtr<Tool> pool = make_pool(3);
  std::atomic<int> lent{0};
  std::latch start(kThreads);
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      start.arrive_and_wait();
      for (int round = 0; round < kRounds; ++round) {
        Tool* tool = pool->acquire();
        if (tool == nullptr) continue;
        EXPECT_FALSE(tool->is_lent.exchange(true, std::memory_order_relaxed));
        ++tool->wear;
        lent.fetch_add(1, std::memory_order_relaxed);
        tool->is_lent.store(false, std::memory_order_relaxed);
        Pool<Tool>::recycle(*tool);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::vector<Tool*> tools = borrow_all(*pool);
  EXPECT_EQ((std::set<Tool*>(tools.begin(), tools.end()).size()), 3u);
  int wear = 0;
  for (Tool* tool : tools) {
    wear += tool->wear;
    Pool<Tool>::recycle(*tool);
  }
  EXPECT_EQ(wear, lent.load());
}

// The usual life of a message: one thread lends, others bring back.
TEST_F(PoolTest, LosesNothingBetweenALenderAndItsReturners) {
  constexpr int kReturners = 3;
  constexpr int kLoans = 20'000;
  const PoolPtr<Tool> pool = make_pool(5);
  std::vector<Inbox<Tool>> inboxes(kReturners);
  std::atomic<int> returned{0};
  std::vector<std::thread> returners;
  for (int i = 0; i < kReturners; ++i) {
    returners.emplace_back([&, i] {
      while (returned.load() < kLoans) {
        for (Tool* tool = inboxes[i].take_all(); tool != nullptr;) {
          Tool* next = tool->inbox_next;
          ++tool->wear;
          Pool<Tool>::recycle(*tool);
          returned.fetch_add(1);
          tool = next;
        }
        std::this_thread::yield();
      }
    });
  }
  for (int lent = 0; lent < kLoans;) {
    if (Tool* tool = pool->acquire()) {
      inboxes[lent++ % kReturners].push(*tool);
    } else {
      std::this_thread::yield();
    }
  }
  for (std::thread& thread : returners) thread.join();
  const std::vector<Tool*> tools = borrow_all(*pool);
  EXPECT_EQ(tools.size(), 5u);
  int wear = 0;
  for (Tool* tool : tools) wear += tool->wear;
  EXPECT_EQ(wear, kLoans);
  for (Tool* tool : tools) Pool<Tool>::recycle(*tool);
}

// The bug: close() counted the returned objects after it had let returners count themselves, so the
// last of them could free the pool while close still used it. Here objects return from two threads
// while the owner closes the pool; the sanitizers see a thread that touches a freed pool.
TEST_F(PoolTest, IsFreedOnceWhenObjectsComeHomeWhileTheOwnerCloses) {
  constexpr std::size_t kTools = 4;
  for (int round = 0; round < 500; ++round) {
    PoolPtr<Tool> pool = make_pool(kTools);
    const std::vector<Tool*> tools = borrow_all(*pool);
    std::latch start(3);
    const auto bring_home = [&](std::size_t first) {
      start.arrive_and_wait();
      for (std::size_t i = first; i < kTools; i += 2) Pool<Tool>::recycle(*tools[i]);
    };
    std::thread even(bring_home, 0);
    std::thread odd(bring_home, 1);
    start.arrive_and_wait();
    pool.reset();
    even.join();
    odd.join();
    make_and_close_another_pool();
    ASSERT_EQ(alive_, 0) << "round " << round;
  }
}

struct Box : PoolNode<Box> {
  PoolPtr<Tool> tools;
};

// Pools were freed under the lock that closing a pool takes: one whose objects own another hung.
TEST_F(PoolTest, MayHaveObjectsThatOwnPools) {
  const auto make = [this](void* place, std::uint32_t) {
    auto* const box = new (place) Box;
    box->tools = make_pool(3);
  };
  PoolPtr<Box> boxes(Pool<Box>::create(2, make, 2));
  EXPECT_EQ(alive_, 6);
  boxes.reset();
  EXPECT_EQ(alive_, 0);
}

}  // namespace
}  // namespace takt
