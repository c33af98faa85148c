// SPDX-License-Identifier: Apache-2.0
#include "takt/base/simulated_clock.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Noting final : SimulatedClock::Listener {
  void time_set(Nanoseconds change) noexcept override { changes.push_back(change); }
  std::vector<Nanoseconds> changes;
};

TEST(SimulatedClock, StandsStillUntilItIsSetAndReportsByHowMuch) {
  SimulatedClock clock;
  Noting noting;
  clock.add(noting);
  EXPECT_EQ(clock.now(), TimePoint{});
  clock.set(TimePoint(5s));
  clock.set(TimePoint(2s));
  EXPECT_EQ(clock.now(), TimePoint(2s));
  clock.remove(noting);
  clock.set(TimePoint(9s));
  EXPECT_THAT(noting.changes, testing::ElementsAre(5s, -3s));
}

TEST(SimulatedClock, WhatIsOnTheirWayUsesRealTime) {
  SimulatedClock clock;
  EXPECT_EQ(&clock.real(), &Clock::steady());
  EXPECT_EQ(&Clock::steady().real(), &Clock::steady());
}

}  // namespace
}  // namespace takt
