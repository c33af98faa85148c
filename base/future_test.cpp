// Tests of values that arrive later.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/future.hpp"

#include <atomic>
#include <latch>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

struct Sleeper final : Wakeable {
  void wake() noexcept override {
    wake_count.fetch_add(1);
    wake_count.notify_all();
  }
  std::atomic<int> wake_count{0};
};

TEST(Future, IsNotReadyBeforeTheValueIsSet) {
  const Promise<int> promise;
  const Future<int> future = promise.get_future();
  EXPECT_FALSE(future.ready());
  EXPECT_THAT([&] { future.get(); },
              ThrowsMessage<Error>(HasSubstr("wait with spin_until_future_complete")));
}

TEST(Future, GivesTheSameValueToAllCopies) {
  Promise<std::string> promise;
  const Future<std::string> first = promise.get_future();
  // The copy is what is tested. NOLINTNEXTLINE(performance-unnecessary-copy-initialization)
  const Future<std::string> second = first;
  promise.set_value("arrived");
  EXPECT_TRUE(second.ready());
  EXPECT_EQ(first.get(), "arrived");
  EXPECT_EQ(&first.get(), &second.get());
}

TEST(Future, KeepsItsValueWhenThePromiseIsGone) {
  auto promise = std::make_unique<Promise<std::unique_ptr<int>>>();
  const Future<std::unique_ptr<int>> future = promise->get_future();
  promise->set_value(std::make_unique<int>(7));
  promise.reset();
  EXPECT_EQ(*future.get(), 7);
}

TEST(Future, WakesWhoWatchesWhenTheValueArrives) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  future.state().watch(&sleeper);
  EXPECT_EQ(sleeper.wake_count, 0);
  promise.set_value(1);
  EXPECT_EQ(sleeper.wake_count, 1);
}

TEST(Future, WakesASleepingThreadThatThenSeesTheValue) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  future.state().watch(&sleeper);
  std::thread giver([&] { promise.set_value(42); });
  sleeper.wake_count.wait(0);
  EXPECT_TRUE(future.ready());
  EXPECT_EQ(future.get(), 42);
  giver.join();
}

TEST(Future, LeavesAloneWhoDoesNotWatchAnyMore) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper first, second;
  future.state().watch(&first);
  future.state().watch(&second);
  promise.set_value(1);
  EXPECT_EQ(first.wake_count, 0);
  EXPECT_EQ(second.wake_count, 1);
}

// With address or thread sanitizer a wake-up that comes after watch(nullptr) would be reported.
TEST(Future, NeverTouchesAWaiterAfterWatchNullptrReturned) {
  for (int round = 0; round < 300; ++round) {
    Promise<int> promise;
    const Future<int> future = promise.get_future();
    auto sleeper = std::make_unique<Sleeper>();
    future.state().watch(sleeper.get());
    std::latch start(2);
    std::thread giver([&] {
      start.arrive_and_wait();
      promise.set_value(round);
    });
    start.arrive_and_wait();
    future.state().watch(nullptr);
    EXPECT_LE(sleeper->wake_count, 1);
    sleeper.reset();
    giver.join();
    EXPECT_EQ(future.get(), round);
  }
}

TEST(Promise, SetsAValueWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  { const ReadSection registers_this_thread; }
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  future.state().watch(&sleeper);
  const RealtimeScope scope;
  promise.set_value(1);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(future.ready());
}

}  // namespace
}  // namespace takt
