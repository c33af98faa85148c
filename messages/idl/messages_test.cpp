// Tests of what takt_add_messages makes of testdata: fields, names, and the bytes on the wire.
// SPDX-License-Identifier: Apache-2.0
#include <type_traits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/yaml.hpp"

#include "other_msgs/msg/laser_scan.hpp"
#include "test_msgs/action/count.hpp"
#include "test_msgs/drive.hpp"
#include "test_msgs/msg/everything.hpp"
#include "test_msgs/msg/shapes.hpp"
#include "test_msgs/srv/add.hpp"
#include "test_msgs/srv/ask.hpp"

namespace takt {
namespace {

using test_msgs::msg::Colour;
using test_msgs::msg::Everything;
using test_msgs::msg::Shapes;
using test_msgs::msg::Small;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;

template <class T>
std::vector<int> encoded(const T& message) {
  ByteBuffer buffer;
  message_type<T>().encode(&message, buffer);
  std::vector<int> result;
  for (const std::byte byte : buffer.bytes()) result.push_back(std::to_integer<int>(byte));
  return result;
}

Shapes some_shapes() {
  Shapes shapes;
  shapes.colour = Colour::GREEN;
  shapes.size = Small::TWO;
  shapes.part.set__id(7).set__weight(0);
  shapes.parts = {test_msgs::msg::Part().set__id(8).set__weight(1)};
  shapes.grid = {{{1, 2, 3}, {4, 5, 6}}};
  shapes.rows = {{1}, {}, {2, -1}};
  shapes.word = "hi";
  shapes.colours = {Colour::RED, Colour::GREEN};
  shapes.sizes = {Small::ONE, Small::TWO};
  shapes.raw = 9;
  shapes.on = true;
  return shapes;
}

TEST(GeneratedMessage, HasTheNameThatRos2OrTheIdlGivesIt) {
  EXPECT_EQ(message_type<Shapes>().name, "test_msgs/msg/Shapes");
  EXPECT_EQ(message_type<test_msgs::msg::Wire>().name, "test_msgs/msg/Wire");
  EXPECT_EQ(message_type<test_msgs::srv::Add::Request>().name, "test_msgs/srv/Add_Request");
  EXPECT_EQ(message_type<test_msgs::action::Count::Goal>().name, "test_msgs/action/Count_Goal");
  EXPECT_EQ(message_type<drive::Wheel>().name, "drive::Wheel");
  EXPECT_EQ(message_type<Alone>().name, "Alone");
}

TEST(GeneratedMessage, HasTheFieldsOfTheIdl) {
  std::vector<std::string> fields;
  for (const MessageField& field : message_type<Shapes>().fields) fields.push_back(field.name);
  EXPECT_THAT(fields,
              ElementsAre("colour", "size", "part", "parts", "grid", "matrix", "rows", "word",
                          "colours", "sizes", "raw", "off", "on", "number", "ratio", "text"));
  static_assert(std::is_same_v<decltype(Shapes::grid), std::array<std::array<std::int32_t, 3>, 2>>);
  static_assert(std::is_same_v<decltype(Shapes::matrix), test_msgs::msg::Matrix>);
  static_assert(std::is_same_v<decltype(Shapes::rows), std::vector<std::vector<std::int16_t>>>);
  static_assert(std::is_same_v<decltype(Shapes::word), Bounded<std::string, 5>>);
  static_assert(std::is_same_v<std::underlying_type_t<Small>, std::uint8_t>);
}

TEST(GeneratedMessage, HasDefaultValues) {
  const Shapes shapes;
  EXPECT_EQ(shapes.colour, Colour::RED);
  EXPECT_EQ(shapes.number, -7);
  EXPECT_EQ(shapes.ratio, 1.5f);
  EXPECT_EQ(shapes.text, "none");
  EXPECT_EQ(shapes.part.weight, 2.5);
  EXPECT_EQ(shapes.grid[1][2], 0);
}

TEST(GeneratedMessage, HasConstants) {
  static_assert(test_msgs::msg::MOST == 3);
  EXPECT_EQ(test_msgs::msg::GREETING, "say \"hello\"");
  static_assert(test_msgs::msg::FIRST == Colour::GREEN);
  static_assert(Shapes::LIMIT == 500);
}

// Enumerators, nested structs, sequences and arrays, each where XCDR1 has it.
TEST(GeneratedMessage, IsOnTheWireAsByHand) {
  // clang-format off
  const std::vector<int> before_matrix{
      0, 1, 0, 0,                          // header
      5, 0, 0, 0,                          // colour
      1,                                   // size: one byte
      7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,     // part: id, padding to 8, weight
      1, 0, 0, 0, 8, 0, 0, 0,              // parts: one; id, padding to 8
      0, 0, 0, 0, 0, 0, 240, 63,           // its weight
      1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0,  // grid
      4, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0};
  const std::vector<int> behind_matrix{
      3, 0, 0, 0,                          // rows: three
      1, 0, 0, 0, 1, 0, 0, 0,              // with one, padding to 4
      0, 0, 0, 0,                          // with none
      2, 0, 0, 0, 2, 0, 255, 255,          // with two
      3, 0, 0, 0, 'h', 'i', 0, 0,          // word, padding to 4
      2, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0,  // colours
      0, 1,                                // sizes
      9, 0, 1,                             // raw, off, on
      0, 0, 0, 0, 0, 0, 0,                 // padding to 8
      249, 255, 255, 255, 255, 255, 255, 255,
      0, 0, 192, 63,                       // ratio
      5, 0, 0, 0, 'n', 'o', 'n', 'e', 0};
  // clang-format on
  std::vector<int> expected = before_matrix;
  expected.insert(expected.end(), sizeof(test_msgs::msg::Matrix), 0);
  expected.insert(expected.end(), behind_matrix.begin(), behind_matrix.end());
  EXPECT_THAT(encoded(some_shapes()), ElementsAreArray(expected));
}

TEST(GeneratedMessage, ComesBackAsItWent) {
  const Shapes shapes = some_shapes();
  ByteBuffer buffer;
  message_type<Shapes>().encode(&shapes, buffer);
  Shapes back;
  ASSERT_TRUE(message_type<Shapes>().decode(buffer.bytes(), &back));
  EXPECT_EQ(back, shapes);
}

TEST(GeneratedMessage, HasTheFieldsThatItInheritsFirst) {
  EXPECT_THAT(encoded(drive::Axle().set__speed(1).set__part(
                  test_msgs::msg::Part().set__id(3).set__weight(0))),
              ElementsAre(0, 1, 0, 0, 0, 0, 128, 63, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
}

TEST(GeneratedMessage, IsMadeFromRos2sFiles) {
  const Everything message;
  EXPECT_TRUE(message.flag);
  EXPECT_EQ(message.octet, 3);
  EXPECT_EQ(message.letter, 65);
  EXPECT_THAT(message.list, ElementsAre(1, -2));
  EXPECT_THAT(message.names, ElementsAre("a, b", "c\"d"));
  EXPECT_THAT(message.sizes.get(), ElementsAre(1, 2.5));
  EXPECT_THAT(message.four, ElementsAre(1, 2, 3, 16));
  EXPECT_THAT(message.bits, ElementsAre(true, false));
  EXPECT_EQ(message.module, "default");
  EXPECT_EQ(message.class_, -7);
  EXPECT_EQ(message.wide, u"H\u00f6hle \"1\"");
  EXPECT_THAT(message.far, ElementsAre(INT64_MAX, INT64_MIN));
  EXPECT_THAT(message.wides, ElementsAre(u"a", u"\u30cf"));
  EXPECT_EQ(message.point.y, 2.5);
  static_assert(Everything::DEBUG == 10 && Everything::OK == 0);
  EXPECT_EQ(Everything::GREETING, "hello # there");
  EXPECT_EQ(Everything::PLAIN, "without quotes");
  static_assert(std::is_same_v<decltype(Everything::octet), unsigned char>);
  EXPECT_EQ(message_type<Everything>().fields[1].shape.id, FieldShape::byte);
  static_assert(std::is_same_v<decltype(Everything::words),
                               Bounded<std::vector<Bounded<std::string, 5>>, 3>>);
  static_assert(std::is_same_v<decltype(Everything::scan), other_msgs::msg::LaserScan>);
  static_assert(std::is_same_v<decltype(Everything::header), ::std_msgs::msg::Header>);
  static_assert(Everything::PI == 3.14f);
}

// What programs for rclcpp rely on.
TEST(GeneratedMessage, HasTheShapeOfRos2s) {
  static_assert(std::is_same_v<Everything, test_msgs::msg::Everything_<std::allocator<void>>>);
  static_assert(std::is_same_v<Everything::_list_type, std::vector<std::int64_t>>);
  static_assert(std::is_same_v<Everything::SharedPtr, std::shared_ptr<Everything>>);
  static_assert(std::is_same_v<Everything::ConstSharedPtr, std::shared_ptr<const Everything>>);
  const Everything zero(MessageInitialization::ZERO);
  EXPECT_FALSE(zero.flag);
  EXPECT_EQ(zero.module, "");
  EXPECT_EQ(zero.point.y, 0) << "also of messages inside";
  EXPECT_EQ(Everything(MessageInitialization::ALL), Everything());
  EXPECT_EQ(Everything(std::allocator<void>()), Everything());
  EXPECT_NE(zero, Everything());
}

TEST(GeneratedMessage, IsYamlAsRos2PrintsIt) {
  using test_msgs::msg::to_yaml;
  test_msgs::msg::Point point;
  EXPECT_EQ(test_msgs::msg::to_yaml(point), "x: 0.00000\ny: 2.50000\nz: 0.00000\n");
  EXPECT_EQ(to_yaml(point, true), "{x: 0.00000, y: 2.50000, z: 0.00000}");
  test_msgs::action::Count::Result result;
  EXPECT_EQ(to_yaml(result), "counted: []\n");
  result.counted = {1, 2};
  EXPECT_EQ(to_yaml(result), "counted:\n- 1\n- 2\n");
  const std::string shapes = to_yaml(some_shapes());
  EXPECT_THAT(shapes, HasSubstr("colour: 5\n"));
  EXPECT_THAT(shapes, HasSubstr("part:\n  id: 7\n  weight: 0.00000\nparts:\n-\n  id: 8\n"));
  EXPECT_THAT(shapes, HasSubstr("word: \"hi\"\n"));
  EXPECT_THAT(to_yaml(Everything(), true), HasSubstr("names: [\"a, b\", \"c\\\"d\"]"));
  EXPECT_EQ(to_yaml(test_msgs::msg::Empty(), true), "null");
}

TEST(GeneratedMessage, MayHaveNoFields) {
  EXPECT_THAT(encoded(test_msgs::msg::Empty{}), ElementsAre(0, 1, 0, 0, 0));
  EXPECT_THAT(encoded(test_msgs::srv::Ask::Request{}), ElementsAre(0, 1, 0, 0, 0));
}

TEST(GeneratedMessage, OfAnActionIsThreeInOne) {
  EXPECT_EQ(test_msgs::action::Count::Goal().limit, 10);
  EXPECT_TRUE(test_msgs::action::Count::Result().counted.empty());
  EXPECT_EQ(test_msgs::action::Count::Feedback().where.y, 2.5);
}

}  // namespace
}  // namespace takt
