// SPDX-License-Identifier: Apache-2.0
#include "takt/base/simulated_clock.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

struct Noting final : SimulatedClock::Listener {
  void time_set(bool is_switched) noexcept override {
    calls.emplace_back(is_switched ? "switched" : "set");
  }
  std::vector<std::string> calls;
};

TEST(SimulatedClock, StandsStillUntilItIsSetAndNotifies) {
  SimulatedClock clock;
  Noting noting;
  clock.add(noting);
  EXPECT_EQ(clock.now(), TimePoint{});
  clock.set(TimePoint(5s));
  clock.set(TimePoint(2s));
  EXPECT_EQ(clock.now(), TimePoint(2s));
  clock.simulate(true);  // as it does already
  clock.simulate(false);
  clock.set(TimePoint(7s));  // is nothing to it
  clock.remove(noting);
  clock.simulate(true);
  EXPECT_THAT(noting.calls, ElementsAre("set", "set", "switched"));
}

TEST(SimulatedClock, ItsTimelineGoesOnWithItAndNeverBack) {
  SimulatedClock clock;
  Clock& timeline = clock.timeline();
  clock.set(TimePoint(5s));
  EXPECT_EQ(timeline.now(), TimePoint(5s));
  clock.set(TimePoint(1s));
  EXPECT_EQ(timeline.now(), TimePoint(5s));
  EXPECT_EQ(clock.on_timeline(TimePoint(3s)), TimePoint(7s));
  EXPECT_EQ(clock.on_timeline(kNever), kNever);
  clock.set(TimePoint(2s));
  EXPECT_EQ(timeline.now(), TimePoint(6s));
  EXPECT_EQ(timeline.as_simulated().get(), &clock);
  EXPECT_EQ(&timeline.timeline(), &timeline);
}

TEST(SimulatedClock, IsTheRealClockWhileItDoesNotSimulate) {
  ManualClock real(TimePoint(1h));
  SimulatedClock clock(real, false);
  Clock& timeline = clock.timeline();
  EXPECT_EQ(clock.now(), TimePoint(1h));
  EXPECT_EQ(timeline.now(), TimePoint(1h));
  EXPECT_EQ(clock.as_manual(), &real);
  clock.simulate(true);
  real.advance(3s);
  EXPECT_EQ(clock.now(), TimePoint{});
  EXPECT_EQ(timeline.now(), TimePoint(1h));
  EXPECT_EQ(clock.as_manual(), nullptr);
  clock.set(TimePoint(100h));  // where its time begins
  clock.set(TimePoint(100h + 1s));
  EXPECT_EQ(timeline.now(), TimePoint(1h + 1s));
  clock.simulate(false);
  EXPECT_EQ(clock.now(), TimePoint(1h + 3s));
  EXPECT_EQ(timeline.now(), TimePoint(1h + 1s));
  EXPECT_EQ(clock.on_timeline(TimePoint(1h + 4s)), TimePoint(1h + 2s));
  real.advance(2s);
  EXPECT_EQ(timeline.now(), TimePoint(1h + 3s));
}

TEST(SimulatedClock, ReleasesOnItsTimelineHaveRealTimes) {
  ManualClock real(TimePoint(10s));
  SimulatedClock clock(real, false);
  EXPECT_EQ(clock.real_time_of(TimePoint(11s)), TimePoint(11s));
  clock.simulate(true);
  clock.set(TimePoint{});
  EXPECT_EQ(clock.real_time_of(TimePoint(11s)), kNever);
  real.advance(5s);
  clock.set(TimePoint(1s));
  real.advance(1s);
  EXPECT_EQ(clock.real_time_of(TimePoint(11s)), TimePoint(15s));  // when it was set
  clock.simulate(false);
  EXPECT_EQ(clock.real_time_of(TimePoint(13s)), TimePoint(18s));
  EXPECT_EQ(clock.real_time_of(kNever), kNever);
}

TEST(SimulatedClock, WhatIsOnTheirWayUsesRealTime) {
  SimulatedClock clock;
  EXPECT_EQ(&clock.real(), &Clock::steady());
  EXPECT_EQ(&Clock::steady().real(), &Clock::steady());
}

}  // namespace
}  // namespace takt
