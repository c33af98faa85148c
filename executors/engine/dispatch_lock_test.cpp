// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatch_lock.hpp"

#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace takt::detail {
namespace {

void lock_often(DispatchLock& lock, DispatchLock::Worker& self) {
  for (int i = 0; i < 1000; ++i) {
    lock.lock(self);
    lock.unlock(self);
  }
}

TEST(DispatchLock, FavoursAWorkerThatIsAloneWithIt) {
  DispatchLock lock(2, true);
  auto& self = lock.enter(0);
  lock_often(lock, self);
  if (!self.is_favourite) GTEST_SKIP() << "this kernel does not grant membarrier";
  std::jthread([&] {
    auto& other = lock.enter(1);
    lock.lock(other);  // the favourite is not inside, and need not be asked
    EXPECT_FALSE(other.has_met_another);
    lock.unlock_and_leave(other);
  }).join();
  EXPECT_TRUE(self.is_favourite) << "it does not know yet";
  EXPECT_TRUE(lock.try_run(self, [] {}));
  EXPECT_FALSE(self.is_favourite);
}

TEST(DispatchLock, FavoursAWorkerAgainThatHasLeft) {
  DispatchLock lock(2, true);
  auto& self = lock.enter(0);
  lock_often(lock, self);
  const bool is_granted = self.is_favourite;
  lock.lock(self);
  lock.unlock_and_leave(self);
  EXPECT_FALSE(self.is_favourite);
  lock_often(lock, self);
  EXPECT_EQ(self.is_favourite, is_granted);
}

TEST(DispatchLock, TriesInVainWhileAnyWorkerIsInside) {
  for (const bool may_favour : {false, true}) {
    DispatchLock lock(2, may_favour);
    auto& self = lock.enter(0);
    lock_often(lock, self);
    const bool has_run = lock.try_run(self, [&] {
      EXPECT_FALSE(lock.try_run(self, [] {}));
      std::jthread([&] {
        auto& other = lock.enter(1);
        EXPECT_FALSE(lock.try_run(other, [] {}));
        EXPECT_EQ(lock.count_meetings(other), 1u);
        EXPECT_FALSE(lock.try_run(other, [] {}));
        EXPECT_EQ(lock.count_meetings(other), 2u);
        EXPECT_EQ(lock.count_meetings(other), 0u);
      }).join();
    });
    EXPECT_TRUE(has_run);
    EXPECT_EQ(lock.count_meetings(self), 0u) << "it has met only itself";
  }
}

TEST(DispatchLock, SaysWhetherAnotherWorkerHasHadIt) {
  DispatchLock lock(2, true);
  const auto dispatch = [&lock](DispatchLock::Worker& self) {
    const bool nobody_else = lock.lock(self);
    lock.unlock(self);
    return nobody_else;
  };
  auto& self = lock.enter(0);
  EXPECT_FALSE(dispatch(self)) << "the first time";
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(dispatch(self)) << i;  // it becomes the favourite
  std::jthread([&] {
    auto& other = lock.enter(1);
    EXPECT_FALSE(dispatch(other));
    EXPECT_TRUE(dispatch(other));
  }).join();
  EXPECT_FALSE(dispatch(self));
  EXPECT_TRUE(dispatch(self));
}

TEST(DispatchLock, FavoursNobodyWhereItMustNot) {
  DispatchLock lock(2, false);
  auto& self = lock.enter(0);
  lock_often(lock, self);
  EXPECT_FALSE(self.is_favourite);
}

TEST(DispatchLock, AWorkerWaitsForAFavouriteThatIsInside) {
  DispatchLock lock(2, true);
  auto& self = lock.enter(0);
  lock_often(lock, self);
  lock.lock(self);
  std::atomic<bool> begins{false};
  bool is_inside = true;
  std::jthread other([&] {
    auto& waiter = lock.enter(1);
    begins = true;
    lock.lock(waiter);
    EXPECT_FALSE(is_inside);
    EXPECT_TRUE(waiter.has_met_another);
    lock.unlock_and_leave(waiter);
  });
  while (!begins) std::this_thread::yield();
  for (int i = 0; i < 100; ++i) std::this_thread::yield();  // some go to the kernel meanwhile
  is_inside = false;
  lock.unlock(self);
}

// Another thread may be the worker later: the lock must not belong to the first one.
TEST(DispatchLock, AFavouriteThatLeavesLeavesNothingBehind) {
  DispatchLock lock(2, true);
  for (int round = 0; round < 3; ++round) {
    std::jthread([&] {
      auto& self = lock.enter(0);
      lock_often(lock, self);
      lock.lock(self);
      lock.unlock_and_leave(self);
      EXPECT_TRUE(lock.try_run(self, [] {})) << "it is not inside";
    }).join();
    auto& other = lock.enter(1);
    lock.lock(other);
    lock.unlock_and_leave(other);
  }
}

// Bursts make favourites, pauses of random length end them at all their places.
TEST(DispatchLock, ExcludesWhileFavouritesChange) {
  constexpr std::size_t kWorkers = 3;
  constexpr int kBursts = 2000;
  DispatchLock lock(kWorkers, true);
  std::uint64_t count = 0, expected = 0;
  {
    std::vector<std::jthread> threads;
    std::atomic<std::uint64_t> sum{0};
    for (std::size_t worker = 0; worker < kWorkers; ++worker) {
      threads.emplace_back([&, worker] {
        auto& self = lock.enter(worker);
        std::mt19937 random(static_cast<unsigned>(worker));
        for (int burst = 0; burst < kBursts; ++burst) {
          const std::uint64_t length = random() % 8 == 0 ? 200 : random() % 4;
          for (std::uint64_t i = 0; i < length; ++i) {
            lock.lock(self);
            ++count;
            lock.unlock(self);
          }
          lock.lock(self);
          ++count;
          random() % 2 == 0 ? lock.unlock(self) : lock.unlock_and_leave(self);
          sum += length + 1;
          if (random() % 4 == 0) std::this_thread::yield();
        }
        lock.lock(self);
        lock.unlock_and_leave(self);
      });
    }
    threads.clear();
    expected = sum;
  }
  EXPECT_EQ(count, expected);
}

}  // namespace
}  // namespace takt::detail
