// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/latency_slices.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace takt {
namespace {

using namespace std::chrono_literals;

TEST(LatencySlices, CountsEachLatencyInTheSliceOfItsTime) {
  const auto slices = std::make_unique<LatencySlices>(10ms);
  slices->record(TimePoint(99s), 1us);  // before the beginning
  slices->begin(TimePoint(100s));
  slices->record(TimePoint(100s) - 1ns, 1us);
  slices->record(TimePoint(100s), 1us);
  slices->record(TimePoint(100s) + 25ms, 3us);
  slices->record(TimePoint(100s) + 29ms, 9us);
  slices->record(TimePoint(200s), 7us);
  EXPECT_EQ(slices->slice(0).count(), 1u);
  EXPECT_EQ(slices->slice(1).count(), 0u);
  EXPECT_EQ(slices->slice(2).count(), 2u);
  EXPECT_GE(slices->slice(2).percentile(1), 9us);
  EXPECT_LE(slices->slice(2).percentile(0.5), 3100ns);
  EXPECT_EQ(slices->slice(LatencySlices::kSlices - 1).count(), 1u);
}

}  // namespace
}  // namespace takt
