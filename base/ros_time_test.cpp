// SPDX-License-Identifier: Apache-2.0
#include "takt/base/ros_time.hpp"

#include <gtest/gtest.h>

#include "takt/messages/std_msgs/msg/header.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

TEST(Time, BecomesTheStampOfAMessageAndIsMadeFromOne) {
  std_msgs::msg::Header header;
  header.stamp = Time(12s + 34ns);
  EXPECT_EQ(header.stamp.sec, 12);
  EXPECT_EQ(header.stamp.nanosec, 34u);
  EXPECT_EQ(std_msgs::msg::Header().set__stamp(Time(-1ns)).stamp.sec, -1);
  EXPECT_EQ(std_msgs::msg::Header().set__stamp(Time(-1ns)).stamp.nanosec, 999'999'999u);
  const Time time = header.stamp;
  EXPECT_EQ(time.nanoseconds(), 12'000'000'034);
  EXPECT_EQ(time, header.stamp);
  EXPECT_EQ(Time(13s) - header.stamp, 1s - 34ns);
  EXPECT_LT(header.stamp, time + 1ns);
  EXPECT_DOUBLE_EQ(Time(1500ms).seconds(), 1.5);
}

TEST(Time, HasNoSumBeyondItsRange) {
  const Time last(Nanoseconds::max()), first(Nanoseconds::min());
  EXPECT_EQ(last + 1ns, last);
  EXPECT_EQ(last - first, Nanoseconds::max());
  EXPECT_EQ(first - last, Nanoseconds::min());
}

// From 2038 on a stamp cannot say it.
TEST(Time, InAMessageIsTheNearestThatFits) {
  const auto late = std_msgs::msg::Header().set__stamp(Time(Nanoseconds::max())).stamp;
  EXPECT_EQ(late.sec, 2'147'483'647);
  EXPECT_EQ(late.nanosec, 999'999'999u);
  const auto early = std_msgs::msg::Header().set__stamp(Time(Nanoseconds::min())).stamp;
  EXPECT_EQ(early.sec, -2'147'483'647 - 1);
  EXPECT_EQ(early.nanosec, 0u);
}

TEST(Time, IsThatOfTheSystem) {
  const auto now = std::chrono::system_clock::now();
  EXPECT_EQ(Time(now).nanoseconds(), now.time_since_epoch().count());
}

}  // namespace
}  // namespace takt
