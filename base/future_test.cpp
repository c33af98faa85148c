// Tests of values that arrive later.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/future.hpp"

#include <array>
#include <atomic>
#include <latch>
#include <memory>
#include <optional>
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
              ThrowsMessage<Error>(
                  HasSubstr("co_await the call; elsewhere, wait with spin_until_future_complete")));
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

TEST(Future, WakesWhoWaitsWhenTheValueArrives) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  const FutureState::Waiter waiter(future.state(), sleeper);
  EXPECT_EQ(sleeper.wake_count, 0);
  promise.set_value(1);
  EXPECT_EQ(sleeper.wake_count, 1);
}

TEST(Future, WakesASleepingThreadThatThenSeesTheValue) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  const FutureState::Waiter waiter(future.state(), sleeper);
  std::thread giver([&] { promise.set_value(42); });
  sleeper.wake_count.wait(0);
  EXPECT_TRUE(future.ready());
  EXPECT_EQ(future.get(), 42);
  giver.join();
}

// A future knew one waiter: the second one took the first one's place, and left none when it went.
TEST(Future, WakesAllThatWait) {
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  std::array<Sleeper, 4> sleepers;
  std::array<std::optional<FutureState::Waiter>, 4> waiters;
  for (std::size_t i = 0; i < 4; ++i) waiters[i].emplace(future.state(), sleepers[i]);
  waiters[2].reset();  // from the middle of the list, and its end
  waiters[0].reset();
  promise.set_value(1);
  EXPECT_EQ(sleepers[0].wake_count, 0);
  EXPECT_EQ(sleepers[1].wake_count, 1);
  EXPECT_EQ(sleepers[2].wake_count, 0);
  EXPECT_EQ(sleepers[3].wake_count, 1);
}

// With address or thread sanitizer a wake-up that comes after the waiter's end would be reported.
TEST(Future, NeverTouchesAWaiterThatHasGone) {
  for (int round = 0; round < 300; ++round) {
    Promise<int> promise;
    const Future<int> future = promise.get_future();
    auto sleeper = std::make_unique<Sleeper>();
    std::optional<FutureState::Waiter> waiter;
    waiter.emplace(future.state(), *sleeper);
    std::latch start(2);
    std::thread giver([&] {
      start.arrive_and_wait();
      promise.set_value(round);
    });
    start.arrive_and_wait();
    waiter.reset();
    EXPECT_LE(sleeper->wake_count, 1);
    sleeper.reset();
    giver.join();
    EXPECT_EQ(future.get(), round);
  }
}

TEST(Promise, SetsAValueWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  Promise<int> promise;
  const Future<int> future = promise.get_future();
  Sleeper sleeper;
  const FutureState::Waiter waiter(future.state(), sleeper);
  const RealtimeScope scope;
  promise.set_value(1);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(future.ready());
}

}  // namespace
}  // namespace takt
