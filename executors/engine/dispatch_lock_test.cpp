// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatch_lock.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/testing/eventually.hpp"

namespace takt::detail {
namespace {

TEST(DispatchLock, AWorkerWaitsForTheOneThatIsInside) {
  DispatchLock lock(true);
  lock.lock();
  std::atomic<bool> begins{false};
  bool is_inside = true;
  std::jthread other([&] {
    begins = true;
    const std::lock_guard guard(lock);
    EXPECT_FALSE(is_inside);
  });
  EXPECT_TRUE(eventually([&] { return begins.load(); }));
  for (int i = 0; i < 100; ++i) std::this_thread::yield();  // it goes to the kernel meanwhile
  is_inside = false;
  lock.unlock();
}

// Short sections end while others look, those with a yield while they wait in the kernel.
TEST(DispatchLock, ExcludesWhetherOthersLookOrSleep) {
  constexpr int kWorkers = 3, kRounds = 20'000;
  DispatchLock lock(true);
  int count = 0;
  {
    std::vector<std::jthread> workers;
    for (int worker = 0; worker < kWorkers; ++worker) {
      workers.emplace_back([&] {
        for (int round = 0; round < kRounds; ++round) {
          const std::lock_guard guard(lock);
          const int before = count;
          if (round % 64 == 0) std::this_thread::yield();
          count = before + 1;
        }
      });
    }
  }
  EXPECT_EQ(count, kWorkers * kRounds);
}

}  // namespace
}  // namespace takt::detail
