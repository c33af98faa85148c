// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/over_time.hpp"

#include <gtest/gtest.h>

namespace takt::rt {
namespace {

using namespace std::chrono_literals;

TEST(OverTime, KeepsEachLatencyInTheSliceOfItsTime) {
  OverTime over_time;
  over_time.record(0ms, 1us);
  over_time.record(OverTime::kShortest * 5 / 2, 3us);
  over_time.record(OverTime::kShortest * 5 / 2, 9us);
  const nlohmann::json json = over_time_json(over_time);
  ASSERT_EQ(json.at("slices").size(), 2u) << json;
  EXPECT_EQ(json["slices"][0]["begin_s"], 0.0);
  EXPECT_EQ(json["slices"][0]["count"], 1);
  EXPECT_DOUBLE_EQ(json["slices"][1]["begin_s"], 2 * json.at("slice_s").get<double>());
  EXPECT_EQ(json["slices"][1]["count"], 2);
  EXPECT_EQ(json["slices"][1]["min_us"], 3.0);
  EXPECT_EQ(json["slices"][1]["max_us"], 9.0);
}

TEST(OverTime, MakesOneSliceOfTwoWhenTheTimeIsLonger) {
  OverTime over_time;
  const Nanoseconds first = over_time.slice_length();
  for (std::size_t i = 0; i < OverTime::kSlices; ++i) {
    over_time.record(first * i, std::chrono::microseconds(i));
  }
  over_time.make_room(first * OverTime::kSlices);
  EXPECT_EQ(over_time.slice_length(), first);  // just enough
  over_time.make_room(first * OverTime::kSlices + 1ns);
  EXPECT_EQ(over_time.slice_length(), 2 * first);
  for (std::size_t i = 0; i < OverTime::kSlices; ++i) {
    const Histogram& slice = over_time.slices()[i];
    const bool is_used = i < OverTime::kSlices / 2;
    EXPECT_EQ(slice.count(), is_used ? 2u : 0u) << i;
    EXPECT_EQ(slice.max(), is_used ? std::chrono::microseconds(2 * i + 1) : 0us) << i;
  }
}

TEST(OverTime, CountsWhatIsLaterThanExpectedInTheLastSlice) {
  OverTime over_time;
  over_time.record(1h, 7us);
  EXPECT_EQ(over_time.slices().back().max(), 7us);
}

TEST(OverTime, MakesRoomForWhatWasMeasuredElsewhere) {
  OverTime over_time(1s);
  Histogram part;
  part.record(7us);
  over_time.add(OverTime::kSlices * 1s - 1ns, part);
  EXPECT_EQ(over_time.slice_length(), 1s);
  EXPECT_EQ(over_time.slices().back().count(), 1u);
  over_time.add(OverTime::kSlices * 1s, part);
  EXPECT_EQ(over_time.slice_length(), 2s);
  EXPECT_EQ(over_time.slices()[OverTime::kSlices / 2 - 1].count(), 1u);
  EXPECT_EQ(over_time.slices()[OverTime::kSlices / 2].count(), 1u);
}

}  // namespace
}  // namespace takt::rt
