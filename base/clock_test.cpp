// Tests of the steady clock and of CPU time.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/clock.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

TEST(Clock, SteadyIsTheMonotonicClockOfTheStandardLibrary) {
  const TimePoint before = std::chrono::steady_clock::now();
  const TimePoint now = Clock::steady().now();
  const TimePoint after = std::chrono::steady_clock::now();
  EXPECT_LE(before, now);
  EXPECT_LE(now, after);
}

TEST(Clock, SteadyIsOneObjectAndNotManual) {
  EXPECT_EQ(&Clock::steady(), &Clock::steady());
  EXPECT_EQ(Clock::steady().as_manual(), nullptr);
  ManualClock manual;
  EXPECT_EQ(static_cast<Clock&>(manual).as_manual(), &manual);
}

TEST(Clock, ReadingItAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  Clock& clock = Clock::steady();
  const RealtimeScope scope;
  const TimePoint first = clock.now();
  const TimePoint second = clock.now();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_LE(first, second);
}

TEST(BurnCpu, UsesAtLeastTheAmountOfTheCallingThread) {
  const Nanoseconds before = thread_cpu_time();
  burn_cpu(2ms);
  EXPECT_GE(thread_cpu_time() - before, 2ms);
}

TEST(BurnCpu, IsNotChargedToAnotherThread) {
  const Nanoseconds before = thread_cpu_time();
  Nanoseconds burnt{0};
  std::thread other([&] {
    burn_cpu(30ms);
    burnt = thread_cpu_time();
  });
  other.join();
  EXPECT_GE(burnt, 30ms);
  EXPECT_LT(thread_cpu_time() - before, 30ms);
}

}  // namespace
}  // namespace takt
