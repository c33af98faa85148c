// Tests of strings and sequences with a bound.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/bounded.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/message_type.hpp"

namespace takt {
namespace {

using testing::ElementsAre;

struct Narrow {
  Bounded<std::vector<std::int32_t>, 2> numbers = {1};
  Bounded<std::string, 3> text = "abc";
  friend bool operator==(const Narrow&, const Narrow&) = default;
};
TAKT_MESSAGE(Narrow, "test_msgs/msg/Narrow", numbers, text);
struct Wide {
  std::vector<std::int32_t> numbers;
  std::string text;
};
TAKT_MESSAGE(Wide, "test_msgs/msg/Wide", numbers, text);

bool is_taken_as_narrow(const Wide& wide, Narrow& narrow) {
  ByteBuffer buffer;
  message_type<Wide>().encode(&wide, buffer);
  return message_type<Narrow>().decode(buffer.bytes(), &narrow);
}

TEST(Bounded, IsTheContainerUntilItsBound) {
  Narrow narrow;
  narrow.numbers.push_back(2);
  EXPECT_THAT(narrow.numbers.get(), ElementsAre(1, 2));
  narrow.numbers = std::vector<std::int32_t>{3};
  EXPECT_THAT(narrow.numbers.get(), ElementsAre(3));
  narrow.text = "xyz";
  EXPECT_EQ(narrow.text.get(), "xyz");
}

TEST(Bounded, StaysAsItWasWhenMoreWouldNotFit) {
  Narrow narrow;
  narrow.numbers = {1, 2};
  EXPECT_THROW(narrow.numbers.push_back(3), std::length_error);
  EXPECT_THROW(narrow.numbers.resize(3), std::length_error);
  EXPECT_THROW((narrow.numbers = {1, 2, 3}), std::length_error);
  EXPECT_THROW(narrow.text = "four", std::length_error);
  EXPECT_THAT(narrow.numbers.get(), ElementsAre(1, 2));
  EXPECT_EQ(narrow.text.get(), "abc");
}

// What rosidl's BoundedVector can: programs for rclcpp insert, assign and emplace.
TEST(Bounded, GrowsInAnyWayUpToItsBound) {
  Bounded<std::vector<int>, 4> numbers;
  numbers.emplace_back(1);
  numbers.insert(numbers.begin(), 0);
  const std::vector<int> more{2, 3};
  numbers.insert(numbers.end(), more.begin(), more.end());
  EXPECT_THAT(numbers.get(), ElementsAre(0, 1, 2, 3));
  EXPECT_THROW(numbers.emplace_back(4), std::length_error);
  EXPECT_THROW(numbers.insert(numbers.begin(), 4), std::length_error);
  EXPECT_THROW(numbers.assign(5, 0), std::length_error);
  EXPECT_THAT(numbers.get(), ElementsAre(0, 1, 2, 3));
  numbers.erase(numbers.begin());
  EXPECT_THROW(numbers.insert(numbers.end(), more.begin(), more.end()), std::length_error);
  numbers.assign(more.begin(), more.end());
  EXPECT_EQ(numbers.at(1), 3);
  EXPECT_THROW(numbers.at(2), std::out_of_range);
}

TEST(Bounded, IsOnTheWireAsTheContainer) {
  Narrow narrow;
  EXPECT_TRUE(is_taken_as_narrow({{5, 6}, "xy"}, narrow));
  EXPECT_THAT(narrow.numbers.get(), ElementsAre(5, 6));
  EXPECT_EQ(narrow.text.get(), "xy");
}

TEST(Bounded, RefusesWhatComesAndIsTooLong) {
  Narrow narrow;
  EXPECT_FALSE(is_taken_as_narrow({{5, 6, 7}, "xy"}, narrow));
  EXPECT_LE(narrow.numbers.size(), 2u);
  EXPECT_FALSE(is_taken_as_narrow({{5, 6}, "four"}, narrow));
  EXPECT_LE(narrow.text.size(), 3u);
}

TEST(Bounded, IsAnotherLayoutThanWithoutABound) {
  EXPECT_NE(message_type<Narrow>().fields[0].type, message_type<Wide>().fields[0].type);
  EXPECT_FALSE(message_type<Narrow>().fixed_size);
}

}  // namespace
}  // namespace takt
