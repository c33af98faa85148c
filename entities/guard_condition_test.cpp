// Tests of callbacks that any thread can ask for.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/guard_condition.hpp"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"

namespace takt::guard_condition_test {
namespace {

using namespace std::chrono_literals;

class CountingSink final : public Sink {
 public:
  void announce(const Arrival& arrival) noexcept override {
    last_sequence.store(arrival.sequence);
    announcements.fetch_add(1);
    announcements.notify_all();
  }
  void release_changed() noexcept override {}
  void remove() noexcept override {}
  void expect_remove() noexcept override {}

  std::atomic<int> announcements{0};
  std::atomic<std::uint64_t> last_sequence{0};
};

class GuardConditionTest : public testing::Test {
 protected:
  ManualClock clock_{TimePoint(1h)};
  int calls_ = 0;
  GuardCondition guard_{
      "stop", std::make_shared<CallbackGroup>("group", CallbackGroupType::MutuallyExclusive),
      clock_, [this] { ++calls_; }};
  Slot slot_;
};

TEST_F(GuardConditionTest, IsNotReadyBeforeItIsTriggered) {
  Arrival arrival;
  EXPECT_EQ(guard_.kind(), EntityKind::waitable);
  EXPECT_EQ(guard_.name(), "stop");
  EXPECT_EQ(guard_.ready_count(), 0u);
  EXPECT_FALSE(guard_.front(arrival));
  EXPECT_FALSE(guard_.take(slot_));
}

TEST_F(GuardConditionTest, IsTakenOnceForAllTriggersThatCameBefore) {
  guard_.trigger();
  guard_.trigger();
  EXPECT_EQ(guard_.ready_count(), 1u);
  EXPECT_TRUE(guard_.take(slot_));
  EXPECT_FALSE(guard_.take(slot_));
  EXPECT_EQ(guard_.ready_count(), 0u);
  EXPECT_EQ(calls_, 0);
  guard_.execute(slot_);
  EXPECT_EQ(calls_, 1);
}

TEST_F(GuardConditionTest, IsReadyAgainWhenTriggeredAfterItWasTaken) {
  guard_.trigger();
  ASSERT_TRUE(guard_.take(slot_));
  guard_.trigger();  // before the callback has run: it asks for another run
  guard_.execute(slot_);
  EXPECT_TRUE(guard_.take(slot_));
}

TEST_F(GuardConditionTest, ReportsWhenItWasFirstTriggered) {
  const TimePoint first_time = clock_.now();
  guard_.trigger();
  Arrival first;
  ASSERT_TRUE(guard_.front(first));
  clock_.advance(5ms);
  guard_.trigger();
  Arrival still;
  ASSERT_TRUE(guard_.front(still));
  EXPECT_EQ(still.sequence, first.sequence);
  EXPECT_EQ(still.ready_time, first_time);
  ASSERT_TRUE(guard_.take(slot_));
  EXPECT_EQ(slot_.sequence, first.sequence);
  EXPECT_EQ(slot_.ready_time, first_time);
}

TEST_F(GuardConditionTest, AnnouncesEveryTriggerWhileItIsAttached) {
  CountingSink sink;
  guard_.attach(sink);
  guard_.trigger();
  Arrival arrival;
  ASSERT_TRUE(guard_.front(arrival));
  EXPECT_EQ(sink.last_sequence, arrival.sequence);
  guard_.trigger();
  EXPECT_EQ(sink.announcements, 2);
  guard_.detach();
  guard_.trigger();
  EXPECT_EQ(sink.announcements, 2);
}

TEST_F(GuardConditionTest, NeedsNoCallback) {
  GuardCondition silent("silent", guard_.group(), clock_, {});
  silent.trigger();
  ASSERT_TRUE(silent.take(slot_));
  EXPECT_NO_THROW(silent.execute(slot_));
}

TEST_F(GuardConditionTest, IsTriggeredAndTakenWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  { const ReadSection registers_this_thread; }
  CountingSink sink;
  guard_.attach(sink);
  const RealtimeScope scope;
  guard_.trigger();
  const bool taken = guard_.take(slot_);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(taken);
  guard_.detach();
}

// What a thread wrote before its trigger is seen by the callback that follows it, and the last
// trigger is never lost.
TEST_F(GuardConditionTest, LosesNoTriggerOfManyThreads) {
  constexpr int kThreads = 3;
  constexpr int kTriggers = 3000;
  CountingSink sink;
  guard_.attach(sink);
  std::atomic<int> work{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (int trigger = 0; trigger < kTriggers; ++trigger) {
        work.fetch_add(1, std::memory_order_relaxed);
        guard_.trigger();
      }
    });
  }
  int seen = 0;
  int takes = 0;
  for (int announced = 0; seen < kThreads * kTriggers;) {
    sink.announcements.wait(announced);
    announced = sink.announcements;
    if (guard_.take(slot_)) {
      ++takes;
      seen = work.load(std::memory_order_relaxed);
    }
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(takes, 1);
  EXPECT_LE(takes, kThreads * kTriggers);
  guard_.detach();
}

}  // namespace
}  // namespace takt::guard_condition_test
