// Tests of timers: phase, overruns, cancelling.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/timer.hpp"

#include <atomic>
#include <barrier>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/base/simulated_clock.hpp"

namespace takt::timer_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr TimePoint kStart(1h);

class CountingSink final : public Sink {
 public:
  void announce(const Arrival&) noexcept override { ++announcements; }
  void release_changed() noexcept override { ++changes; }
  void remove() noexcept override {}
  void expect_remove() noexcept override {}

  int announcements = 0;
  int changes = 0;
};

class TimerTest : public testing::Test {
 protected:
  Timer make(
      Nanoseconds period, std::function<void()> callback = [] {}) {
    return Timer("tick", group_, clock_, period, std::move(callback));
  }
  /// When the release that was taken was due, since the start; or "none".
  static std::string take(Timer& timer) {
    Slot slot;
    if (!timer.take(slot)) return "none";
    EXPECT_EQ(slot.expected_period, timer.period());
    return std::to_string((slot.ready_time - kStart) / 1ms);
  }

  ManualClock clock_{kStart};
  std::shared_ptr<CallbackGroup> group_ =
      std::make_shared<CallbackGroup>("group", CallbackGroupType::MutuallyExclusive);
};

TEST_F(TimerTest, KnowsWhatItIs) {
  const Timer timer = make(10ms);
  EXPECT_EQ(timer.kind(), EntityKind::timer);
  EXPECT_EQ(timer.name(), "tick");
  EXPECT_EQ(timer.group(), group_);
  EXPECT_EQ(timer.period(), 10ms);
  EXPECT_EQ(&timer.clock(), &clock_);
  EXPECT_FALSE(timer.is_attached());
}

TEST_F(TimerTest, IsDueOnePeriodAfterItWasMade) {
  Timer timer = make(10ms);
  EXPECT_EQ(timer.next_release(), kStart + 10ms);
  EXPECT_EQ(timer.ready_count(), 0u);
  clock_.advance(10ms - 1ns);
  EXPECT_EQ(timer.ready_count(), 0u);
  EXPECT_EQ(take(timer), "none");
  clock_.advance(1ns);
  EXPECT_EQ(timer.ready_count(), 1u);
  EXPECT_EQ(take(timer), "10");
  EXPECT_EQ(timer.ready_count(), 0u);
  EXPECT_EQ(take(timer), "none");
}

TEST_F(TimerTest, KeepsItsPhaseWhenItIsServedLate) {
  Timer timer = make(10ms);
  clock_.advance(17ms);
  EXPECT_EQ(take(timer), "10");
  EXPECT_EQ(timer.next_release(), kStart + 20ms);
  clock_.advance(4ms);
  EXPECT_EQ(take(timer), "20");
  EXPECT_EQ(timer.missed(), 0u);
}

TEST_F(TimerTest, HasOneReleaseAfterAnOverrunAndCountsTheOthersAsMissed) {
  Timer timer = make(10ms);
  clock_.advance(35ms);
  EXPECT_EQ(timer.ready_count(), 1u);
  EXPECT_EQ(take(timer), "10");
  EXPECT_EQ(take(timer), "none");
  EXPECT_EQ(timer.missed(), 2u);
  EXPECT_EQ(timer.next_release(), kStart + 40ms);
  clock_.advance(15ms);  // exactly at a release: 40 is late, 50 is missed
  EXPECT_EQ(take(timer), "40");
  EXPECT_EQ(timer.missed(), 3u);
  EXPECT_EQ(timer.counts().missed, 3u);
  EXPECT_EQ(timer.next_release(), kStart + 60ms);
}

TEST_F(TimerTest, KeepsAsManyReleasesAsMayWait) {
  Timer timer = make(10ms);
  timer.set_most_releases(3);
  clock_.advance(25ms);
  EXPECT_EQ(timer.ready_count(), 2u);
  clock_.advance(30ms);  // 10 to 50 are due
  EXPECT_EQ(timer.ready_count(), 3u);
  EXPECT_EQ(take(timer), "10");
  EXPECT_EQ(timer.missed(), 2u);  // 20 and 30
  EXPECT_EQ(take(timer), "40");
  EXPECT_EQ(take(timer), "50");
  EXPECT_EQ(take(timer), "none");
  EXPECT_EQ(timer.missed(), 2u);
  EXPECT_EQ(timer.next_release(), kStart + 60ms);
}

TEST_F(TimerTest, IsNeverDueAfterCancel) {
  Timer timer = make(10ms);
  clock_.advance(10ms);
  timer.cancel();  // the outstanding release too
  EXPECT_TRUE(timer.is_canceled());
  EXPECT_EQ(timer.next_release(), kNever);
  EXPECT_EQ(timer.ready_count(), 0u);
  EXPECT_EQ(take(timer), "none");
  clock_.advance(1h);
  EXPECT_EQ(take(timer), "none");
}

TEST_F(TimerTest, BeginsANewPhaseWithReset) {
  Timer timer = make(10ms);
  clock_.advance(14ms);
  timer.reset();  // drops the release of 10
  EXPECT_EQ(take(timer), "none");
  clock_.advance(10ms);
  EXPECT_EQ(take(timer), "24");
  EXPECT_EQ(timer.missed(), 0u);
}

// Beginning all phases together must not change a release that was set.
TEST_F(TimerTest, BeginsItsPhaseUnlessItsReleaseWasGiven) {
  Timer periodic = make(10ms), cancelled = make(10ms), given = make(10ms), reset = make(10ms);
  cancelled.cancel();
  given.release_at(kStart + 3ms);
  reset.cancel();
  reset.reset();
  clock_.advance(5ms);
  for (Timer* timer : {&periodic, &cancelled, &given, &reset}) timer->begin_phase();
  EXPECT_EQ(periodic.next_release(), kStart + 15ms);
  EXPECT_TRUE(cancelled.is_canceled());
  EXPECT_EQ(given.next_release(), kStart + 3ms);
  EXPECT_EQ(reset.next_release(), kStart + 15ms);
}

TEST_F(TimerTest, RunsAgainWhenItIsResetAfterCancel) {
  Timer timer = make(10ms);
  timer.cancel();
  clock_.advance(95ms);
  timer.reset();
  EXPECT_FALSE(timer.is_canceled());
  clock_.advance(10ms);
  EXPECT_EQ(take(timer), "105");
}

TEST_F(TimerTest, NotifiesItsSinkThatTheReleaseHasChanged) {
  Timer timer = make(10ms);
  CountingSink sink;
  timer.attach(sink);
  EXPECT_TRUE(timer.is_attached());
  timer.cancel();
  timer.reset();
  EXPECT_EQ(sink.changes, 2);
  clock_.advance(10ms);
  EXPECT_EQ(take(timer), "10");  // which is no change: the executor took it
  EXPECT_EQ(sink.changes, 2);
  EXPECT_EQ(sink.announcements, 0);
  timer.detach();
  EXPECT_FALSE(timer.is_attached());
  timer.cancel();
  EXPECT_EQ(sink.changes, 2);
}

TEST_F(TimerTest, CallsItsCallbackWhichMayCancelIt) {
  std::vector<TimePoint> calls;
  Timer* self = nullptr;
  Timer timer = make(10ms, [&] {
    calls.push_back(clock_.now());
    self->cancel();
  });
  self = &timer;
  clock_.advance(10ms);
  Slot slot;
  ASSERT_TRUE(timer.take(slot));
  timer.execute(slot);
  EXPECT_THAT(calls, ElementsAre(kStart + 10ms));
  EXPECT_TRUE(timer.is_canceled());
}

// The executor's time has nothing to do with a simulated clock's: releases of hours were skipped.
TEST_F(TimerTest, OnASimulatedClockSkipsWhatIsDueThere) {
  SimulatedClock simulated(clock_);
  Timer timer("tick", group_, simulated, 10ms, [] {});
  simulated.set(TimePoint(35ms));
  timer.skip_releases(clock_.now());
  EXPECT_EQ(timer.missed(), 3u);
  Slot slot;
  EXPECT_FALSE(timer.take(slot));
  simulated.set(TimePoint(40ms));
  EXPECT_TRUE(timer.take(slot));
}

TEST_F(TimerTest, RefusesAPeriodThatIsNotPositive) {
  EXPECT_THAT([&] { make(0ns); },
              ThrowsMessage<Error>(HasSubstr("a timer's period must be positive, not 0s")));
  EXPECT_THAT([&] { make(-5ns); }, ThrowsMessage<Error>(HasSubstr("not -5ns")));
}

TEST_F(TimerTest, RefusesToHaveNoCallback) {
  EXPECT_THAT([&] { make(10ms, nullptr); },
              ThrowsMessage<Error>(HasSubstr("timer 'tick' has no callback")));
}

TEST_F(TimerTest, IsTakenCancelledAndResetWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  { const ReadSection registers_this_thread; }
  Timer timer = make(10ms);
  clock_.advance(10ms);
  Slot slot;
  const RealtimeScope scope;
  const bool taken = timer.take(slot);
  timer.execute(slot);
  timer.cancel();
  timer.reset();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(taken);
}

TEST_F(TimerTest, GivesEachReleaseToOneOfSeveralThreads) {
  constexpr int kThreads = 3;
  constexpr int kReleases = 500;
  Timer timer = make(10ms);
  std::atomic<int> taken{0};
  std::vector<int> taken_in_round;
  clock_.advance(10ms);
  std::barrier step(kThreads, [&]() noexcept {
    taken_in_round.push_back(taken.exchange(0));
    clock_.advance(10ms);
  });
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (int release = 0; release < kReleases; ++release) {
        Slot slot;
        if (timer.take(slot)) taken.fetch_add(1);
        step.arrive_and_wait();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken_in_round, std::vector<int>(kReleases, 1));
  EXPECT_EQ(timer.missed(), 0u);
}

}  // namespace
}  // namespace takt::timer_test
