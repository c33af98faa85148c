// Tests of the number that one thread writes and others read.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/counter.hpp"

#include <thread>

#include <gtest/gtest.h>

#include "takt/base/histogram.hpp"

namespace takt {
namespace {

TEST(Counter, CountsAsANumber) {
  Counter<> counter;
  ++counter;
  counter += 4;
  EXPECT_EQ(counter, 5u);
  Counter<> copy = counter;
  ++counter;
  EXPECT_EQ(copy, 5u);
  copy = counter;
  EXPECT_EQ(copy, 6u);
}

// Readers must see what was written before the value that was published.
TEST(Counter, WhatIsPublishedIsSeenWithWhatBelongsToIt) {
  constexpr std::uint64_t kLast = 20'000;
  Counter<> half, whole;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      half = i;
      whole.publish(i);
    }
  });
  for (std::uint64_t seen = 0; seen < kLast;) {  // the writer ends
    seen = whole.load();
    EXPECT_GE(half.load(), seen);
  }
  writer.join();
}

// A histogram that is copied while it is written has its minimum and maximum from what it holds: a
// percentile of its first sample was 0 otherwise.
TEST(Counter, AHistogramIsCopiedWhileItIsWritten) {
  constexpr Nanoseconds kOnly(1'000'000);
  constexpr std::uint64_t kLast = 2'000;
  for (int round = 0; round < 20; ++round) {
    Histogram histogram;
    std::thread writer([&] {
      for (std::uint64_t i = 0; i < kLast; ++i) histogram.record(kOnly);
    });
    for (std::uint64_t held = 0; held < kLast;) {  // the writer ends
      const Histogram copy = histogram;
      held = 0;
      copy.for_each_bucket([&](std::size_t, Nanoseconds, std::uint64_t count) { held += count; });
      EXPECT_GE(copy.count(), held);
      if (held == 0) continue;
      EXPECT_EQ(copy.min(), kOnly);
      EXPECT_EQ(copy.max(), kOnly);
      EXPECT_EQ(copy.percentile(0.5), kOnly);
    }
    writer.join();
  }
}

}  // namespace
}  // namespace takt
