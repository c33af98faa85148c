// Tests of the encoding: bytes compared with XCDR1 written by hand, round trips, malicious bytes.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/cdr.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/message_type.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;

struct Nothing {
  friend bool operator==(const Nothing&, const Nothing&) = default;
};
TAKT_MESSAGE(Nothing, "test_msgs/msg/Nothing");
struct Stamp {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  friend bool operator==(const Stamp&, const Stamp&) = default;
};
TAKT_MESSAGE(Stamp, "test_msgs/msg/Stamp", sec, nanosec);
struct Mixed {
  std::uint8_t tag = 0;
  double value = 0;
  std::string text;
  bool flag = false;
  std::vector<std::uint16_t> numbers;
  std::array<float, 2> pair{};
  Stamp stamp;
  Nothing nothing;
  std::vector<Stamp> stamps;
  std::vector<std::string> texts;
  std::vector<bool> flags;
  std::array<bool, 3> three{};
  std::vector<std::byte> bytes;
  friend bool operator==(const Mixed&, const Mixed&) = default;
};
TAKT_MESSAGE(Mixed, "test_msgs/msg/Mixed", tag, value, text, flag, numbers, pair, stamp, nothing,
             stamps, texts, flags, three, bytes);

struct Texts {
  std::vector<std::string> texts;
};
TAKT_MESSAGE(Texts, "test_msgs/msg/Texts", texts);

template <class T>
std::vector<int> encoded(const T& message) {
  ByteBuffer buffer;
  message_type<T>().encode(&message, buffer);
  std::vector<int> result;
  for (const std::byte byte : buffer.bytes()) result.push_back(std::to_integer<int>(byte));
  return result;
}

const Mixed kMixed{.tag = 1,
                   .value = 2.5,
                   .text = "abc",
                   .flag = true,
                   .numbers = {1, 2, 3},
                   .pair = {1, -1},
                   .stamp = {-5, 6},
                   .nothing = {},
                   .stamps = {{1, 2}, {3, 4}},
                   .texts = {"", "x"},
                   .flags = {true, false},
                   .three = {true, false, true},
                   .bytes = {std::byte{9}}};

TEST(Cdr, StartsWithAHeaderAndAlignsBehindIt) {
  EXPECT_THAT(encoded(Stamp{1, 2}), ElementsAre(0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0));
}

TEST(Cdr, WritesStringsWithTheirZeroAndSequencesWithTheirLength) {
  const std::vector<int> bytes = encoded(Mixed{.tag = 7, .value = 0, .text = "hi", .flag = true});
  const std::vector<int> begin(bytes.begin(), bytes.begin() + 32);
  EXPECT_THAT(begin, ElementsAreArray({0, 1, 0, 0,                  // header
                                       7, 0, 0, 0, 0,   0,   0, 0,  // tag, padding to 8
                                       0, 0, 0, 0, 0,   0,   0, 0,  // value
                                       3, 0, 0, 0, 104, 105, 0, 1,  // text, flag
                                       0, 0, 0, 0}));               // no numbers
}

TEST(Cdr, GivesAMessageWithoutFieldsOneByte) {
  EXPECT_THAT(encoded(Nothing{}), ElementsAre(0, 1, 0, 0, 0));
}

TEST(Cdr, ComesBackAsItWent) {
  ByteBuffer buffer;
  message_type<Mixed>().encode(&kMixed, buffer);
  Mixed back;
  ASSERT_TRUE(message_type<Mixed>().decode(buffer.bytes(), &back));
  EXPECT_EQ(back, kMixed);
}

TEST(Cdr, ReplacesWhatTheReceiverHeld) {
  ByteBuffer buffer;
  const Mixed empty;
  message_type<Mixed>().encode(&empty, buffer);
  Mixed back = kMixed;
  ASSERT_TRUE(message_type<Mixed>().decode(buffer.bytes(), &back));
  EXPECT_EQ(back, empty);
}

TEST(Cdr, RefusesEveryTruncatedMessage) {
  ByteBuffer buffer;
  message_type<Mixed>().encode(&kMixed, buffer);
  Mixed back;
  for (std::size_t size = 0; size < buffer.bytes().size(); ++size) {
    EXPECT_FALSE(message_type<Mixed>().decode(buffer.bytes().first(size), &back)) << size;
  }
}

TEST(Cdr, RefusesOtherEncodings) {
  ByteBuffer buffer;
  message_type<Stamp>().encode(&kMixed.stamp, buffer);
  Stamp back;
  for (const int encoding : {0, 2, 3, 6, 7, 255}) {
    buffer.data()[1] = static_cast<std::byte>(encoding);
    EXPECT_FALSE(message_type<Stamp>().decode(buffer.bytes(), &back)) << encoding;
  }
}

// Wrong lengths must not allocate memory; the sanitizers report any access beyond the bytes.
TEST(Cdr, SurvivesAnyBytes) {
  ByteBuffer original;
  message_type<Mixed>().encode(&kMixed, original);
  std::mt19937 random(1);
  Mixed back;
  for (int round = 0; round < 20'000; ++round) {
    std::vector<std::byte> bytes(original.bytes().begin(), original.bytes().end());
    for (unsigned changes = 1 + random() % 4; changes != 0; --changes) {
      bytes[4 + random() % (bytes.size() - 4)] = static_cast<std::byte>(random());
    }
    bytes.resize(bytes.size() - random() % 3);
    message_type<Mixed>().decode(bytes, &back);
    EXPECT_LE(back.numbers.size(), bytes.size());
    EXPECT_LE(back.stamps.size(), bytes.size());
  }
}

// The decoder once accepted a count if one byte was left per element, but a string has 32 bytes in
// memory.
TEST(Cdr, BelievesACountOnlyWhenSoManyCanFollow) {
  std::vector<std::byte> bytes(kCdrHeader.begin(), kCdrHeader.end());
  bytes.resize(4 + 4 + 16);  // a number, and as many bytes as four empty strings have
  Texts texts;
  bytes[4] = std::byte{4};
  EXPECT_TRUE(message_type<Texts>().decode(bytes, &texts));
  EXPECT_EQ(texts.texts.size(), 4u);
  bytes[4] = std::byte{5};
  texts = {};
  EXPECT_FALSE(message_type<Texts>().decode(bytes, &texts));
  EXPECT_EQ(texts.texts.capacity(), 0u);
}

}  // namespace
}  // namespace takt
