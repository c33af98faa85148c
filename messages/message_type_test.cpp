// Tests of the run-time description of message types.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/message_type.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace takt {
namespace {

struct Point {
  double x, y;
};
TAKT_MESSAGE(Point, "geometry_msgs/msg/Point", x, y);

struct Everything {
  bool flag;
  std::byte octet;
  char letter;
  std::int8_t i8;
  std::uint16_t u16;
  std::int32_t i32;
  std::uint64_t u64;
  float f32;
  double f64;
  std::string text;
  std::vector<float> numbers;
  std::array<std::int16_t, 3> three;
  std::vector<std::array<Point, 2>> pairs;
  Point point;
};
TAKT_MESSAGE(Everything, "test_msgs/msg/Everything", flag, octet, letter, i8, u16, i32, u64, f32,
             f64, text, numbers, three, pairs, point);

struct Empty {};
TAKT_MESSAGE(Empty, "std_msgs/msg/Empty");

struct Eighty {
  int f00, f01, f02, f03, f04, f05, f06, f07, f08, f09, f10, f11, f12, f13, f14, f15, f16, f17, f18,
      f19, f20, f21, f22, f23, f24, f25, f26, f27, f28, f29, f30, f31, f32, f33, f34, f35, f36, f37,
      f38, f39, f40, f41, f42, f43, f44, f45, f46, f47, f48, f49, f50, f51, f52, f53, f54, f55, f56,
      f57, f58, f59, f60, f61, f62, f63, f64, f65, f66, f67, f68, f69, f70, f71, f72, f73, f74, f75,
      f76, f77, f78, f79;
};
TAKT_MESSAGE(Eighty, "test_msgs/msg/Eighty", f00, f01, f02, f03, f04, f05, f06, f07, f08, f09, f10,
             f11, f12, f13, f14, f15, f16, f17, f18, f19, f20, f21, f22, f23, f24, f25, f26, f27,
             f28, f29, f30, f31, f32, f33, f34, f35, f36, f37, f38, f39, f40, f41, f42, f43, f44,
             f45, f46, f47, f48, f49, f50, f51, f52, f53, f54, f55, f56, f57, f58, f59, f60, f61,
             f62, f63, f64, f65, f66, f67, f68, f69, f70, f71, f72, f73, f74, f75, f76, f77, f78,
             f79);

// Pairs of types that differ in one respect; their layout hashes must differ.
struct Base {
  std::int32_t a, b;
};
TAKT_MESSAGE(Base, "test_msgs/msg/Same", a, b);
struct OtherName {
  std::int32_t a, c;
};
TAKT_MESSAGE(OtherName, "test_msgs/msg/Same", a, c);
struct OtherType {
  std::int32_t a;
  std::uint32_t b;
};
TAKT_MESSAGE(OtherType, "test_msgs/msg/Same", a, b);
struct OtherOrder {
  std::int32_t b, a;
};
TAKT_MESSAGE(OtherOrder, "test_msgs/msg/Same", b, a);
struct OtherOffset {
  std::int32_t a, undescribed, b;
};
TAKT_MESSAGE(OtherOffset, "test_msgs/msg/Same", a, b);
struct OtherSize {
  std::int32_t a, b, undescribed;
};
TAKT_MESSAGE(OtherSize, "test_msgs/msg/Same", a, b);
struct SameAsBase {
  std::int32_t a, b;
};
TAKT_MESSAGE(SameAsBase, "test_msgs/msg/Same", a, b);

struct HoldsBase {
  Base inner;
};
TAKT_MESSAGE(HoldsBase, "test_msgs/msg/Holds", inner);
struct HoldsOtherType {
  OtherType inner;
};
TAKT_MESSAGE(HoldsOtherType, "test_msgs/msg/Holds", inner);

struct Undescribed {};
static_assert(Message<Point>);
static_assert(!Message<Undescribed>);
static_assert(!Message<int>);

struct Hiding {
  std::int32_t described = 0;
  std::string hidden;
};
TAKT_MESSAGE(Hiding, "test_msgs/msg/Hiding", described);

TEST(MessageType, KnowsNameSizeAndAlignment) {
  const MessageType& type = message_type<Point>();
  EXPECT_EQ(type.name, "geometry_msgs/msg/Point");
  EXPECT_EQ(type.size, sizeof(Point));
  EXPECT_EQ(type.alignment, alignof(Point));
  EXPECT_TRUE(type.fixed_size);
  EXPECT_EQ(&type, &message_type<Point>());
}

TEST(MessageType, KnowsEachFieldByNameAndOffset) {
  const MessageType& type = message_type<Point>();
  ASSERT_EQ(type.fields.size(), 2u);
  EXPECT_EQ(type.fields[0].name, "x");
  EXPECT_EQ(type.fields[0].offset, 0u);
  EXPECT_EQ(type.fields[1].name, "y");
  EXPECT_EQ(type.fields[1].offset, sizeof(double));
}

TEST(MessageType, NamesFieldTypesInIdlsWords) {
  std::vector<std::string> types;
  for (const MessageField& field : message_type<Everything>().fields) types.push_back(field.type);
  const std::string point =
      "geometry_msgs/msg/Point#" + std::to_string(message_type<Point>().layout_hash);
  EXPECT_EQ(types,
            (std::vector<std::string>{"boolean", "octet", "char", "int8", "uint16", "int32",
                                      "uint64", "float", "double", "string", "sequence<float>",
                                      "int16[3]", "sequence<" + point + "[2]>", point}));
}

TEST(MessageType, IsOfFixedSizeWithoutStringsAndSequencesOnly) {
  const MessageType& type = message_type<Everything>();
  EXPECT_FALSE(type.fixed_size);
  for (const MessageField& field : type.fields) {
    EXPECT_EQ(field.fixed_size,
              field.name != "text" && field.name != "numbers" && field.name != "pairs")
        << field.name;
  }
  EXPECT_TRUE(message_type<HoldsBase>().fixed_size);
  EXPECT_FALSE(message_type<Hiding>().fixed_size);  // as its bytes are not all of it
}

TEST(MessageType, MayHaveNoFieldsAndEightyFields) {
  EXPECT_TRUE(message_type<Empty>().fields.empty());
  const MessageType& type = message_type<Eighty>();
  ASSERT_EQ(type.fields.size(), 80u);
  for (std::size_t i = 0; i < 80; ++i) EXPECT_EQ(type.fields[i].offset, i * sizeof(int));
}

TEST(MessageType, HasADifferentLayoutHashForEachLayout) {
  const std::uint64_t hash = message_type<Base>().layout_hash;
  EXPECT_EQ(hash, message_type<SameAsBase>().layout_hash);
  EXPECT_NE(hash, message_type<OtherName>().layout_hash);
  EXPECT_NE(hash, message_type<OtherType>().layout_hash);
  EXPECT_NE(hash, message_type<OtherOrder>().layout_hash);
  EXPECT_NE(hash, message_type<OtherOffset>().layout_hash);
  EXPECT_NE(hash, message_type<OtherSize>().layout_hash);
}

TEST(MessageType, HasALayoutHashThatSeesNestedMessages) {
  EXPECT_NE(message_type<HoldsBase>().layout_hash, message_type<HoldsOtherType>().layout_hash);
}

TEST(MessageType, EndsEachWordThatGoesIntoTheHash) {
  const auto hash = [](const char* name, const char* type) {
    return detail::finish_message_type({.name = "x", .fields = {{name, type, 0, true}}})
        .layout_hash;
  };
  EXPECT_NE(hash("ab", "c"), hash("a", "bc"));
}

}  // namespace
}  // namespace takt
