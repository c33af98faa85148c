// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/execution_watch.hpp"

#include <utility>

#include <gtest/gtest.h>

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using Kind = ExecutionWatch::Kind;

TimePoint at(Nanoseconds time) {
  return TimePoint(1s) + time;
}

TEST(ExecutionWatch, CountsWhatIsBeyondItsLimitsAndKeepsTheWorst) {
  ExecutionWatch watch({.execution = 2ms, .bound = 10ms, .distances = {}});
  watch.check(at(0ms), at(10ms), 2ms);
  EXPECT_EQ(watch.seen(Kind::execution).count, 0u);
  EXPECT_EQ(watch.seen(Kind::bound).count, 0u);
  watch.check(at(0ms), at(12ms), 4ms);
  watch.check(at(0ms), at(11ms), 3ms);
  EXPECT_EQ(watch.seen(Kind::execution).count, 2u);
  EXPECT_EQ(watch.seen(Kind::execution).worst, 4ms);
  EXPECT_EQ(watch.seen(Kind::execution).limit, 2ms);
  EXPECT_EQ(watch.seen(Kind::bound).worst, 12ms);
  watch.check({}, at(99ms), 1ms);  // nobody knows when it became ready
  EXPECT_EQ(watch.seen(Kind::bound).count, 2u);
}

// Of three arrivals no two are too close, and all three are.
TEST(ExecutionWatch, ComparesArrivalsWithAllBeforeThem) {
  ExecutionWatch watch({.distances = {5ms, 20ms}});
  for (const Nanoseconds time : {0ms, 6ms, 20ms}) watch.check(at(time), at(time), 0ms);
  EXPECT_EQ(watch.seen(Kind::arrivals).count, 0u);
  watch.check(at(25ms), at(25ms), 0ms);
  EXPECT_EQ(watch.seen(Kind::arrivals).count, 1u);
  EXPECT_EQ(watch.seen(Kind::arrivals).worst, 19ms);
  EXPECT_EQ(watch.seen(Kind::arrivals).limit, 20ms);
  watch.check(at(26ms), at(26ms), 0ms);
  EXPECT_EQ(watch.seen(Kind::arrivals).worst, 6ms);  // 14 ms too early
}

// Each has its distance from the one before, and any few are a burst that is allowed.
TEST(ExecutionWatch, FindsABurstThatGoesOnForTooLong) {
  ExecutionWatch watch({.distances = {2ms}, .period = 10ms, .jitter = 200ms});
  const auto arrive = [&](Nanoseconds time) { watch.check(at(time), at(time), 0ms); };
  Nanoseconds now{0};
  for (int i = 0; i < 26; ++i) arrive(std::exchange(now, now + 2ms));  // 250 ms of work in 50 ms
  EXPECT_EQ(watch.seen(Kind::arrivals).count, 0u);
  arrive(now);
  EXPECT_EQ(watch.seen(Kind::arrivals).count, 1u);
  EXPECT_EQ(watch.seen(Kind::arrivals).worst, 52ms);
  EXPECT_EQ(watch.seen(Kind::arrivals).limit, 60ms);
  now += 300ms;  // it has been silent for long enough to burst again
  for (int i = 0; i < 26; ++i) arrive(std::exchange(now, now + 2ms));
  EXPECT_EQ(watch.seen(Kind::arrivals).count, 1u);
}

}  // namespace
}  // namespace takt::test
