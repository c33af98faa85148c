// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/rounds.hpp"

#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt::rt {
namespace {

TEST(Quantile, LiesBetweenTwoValuesInProportion) {
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0), 1);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0.25), 1.75);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 1), 4);
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({}), 0);
}

TEST(PairedRatio, IsThatOfEachRoundAndNotOfTheMedians) {
  // The machine becomes three times as slow, for both.
  const Interval ratio = paired_ratio({2, 2, 2, 6, 6, 6, 6}, {1, 1, 1, 3, 3, 3, 3});
  EXPECT_EQ(ratio.median, 2);
  EXPECT_EQ(ratio.low, 2);
  EXPECT_EQ(ratio.high, 2);
}

TEST(PairedRatio, HasAnIntervalThatOneBadRoundDoesNotMove) {
  const Interval ratio =
      paired_ratio({11, 10, 12, 10, 900, 11, 10, 12, 11}, {10, 10, 10, 10, 10, 10, 10, 10, 10});
  EXPECT_EQ(ratio.median, 1.1);
  EXPECT_EQ(ratio.low, 1);
  EXPECT_EQ(ratio.high, 1.2);
}

TEST(PairedRatio, HasAWideIntervalForFewRoundsThatDiffer) {
  const Interval ratio = paired_ratio({1, 2, 3}, {1, 1, 1});
  EXPECT_EQ(ratio.low, 1);
  EXPECT_EQ(ratio.high, 3);
}

TEST(PairedRatio, NeedsPairs) {
  EXPECT_THROW(paired_ratio({}, {}), Error);
  EXPECT_THROW(paired_ratio({1, 2}, {1}), Error);
}

}  // namespace
}  // namespace takt::rt
