// Tests of the message types that are known by name.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/message_types.hpp"

#include <functional>

#include <gmock/gmock.h>

#include "takt/base/error.hpp"

namespace takt::types_test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

int described = 0;

struct Inner {
  int value = 0;
};
TAKT_MESSAGE(Inner, "types_test/msg/Inner", value);

struct Outer {
  std::vector<Inner> parts;
};
const MessageType& takt_message_type(const Outer*) {
  ++described;
  static const MessageType type = detail::finish_message_type(
      {.name = "types_test/msg/Outer",
       .fields = {detail::describe_field<std::vector<Inner>>("parts", 0)},
       .size = sizeof(Outer),
       .alignment = alignof(Outer)});
  return type;
}

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

}  // namespace
}  // namespace takt::types_test

TAKT_REGISTER_MESSAGES(takt::types_test::Outer)

namespace takt::types_test {
namespace {

TEST(MessageTypes, AreDescribedAtTheFirstQuestionWithTheTypesInThem) {
  EXPECT_EQ(described, 0);  // as nobody has asked
  const MessageType* outer = message_types().find("types_test/msg/Outer");
  EXPECT_EQ(outer, &message_type<Outer>());
  EXPECT_EQ(message_types().find("types_test/msg/Inner"), &message_type<Inner>());
  EXPECT_EQ(message_types().find("types_test/msg/Inne"), nullptr);
  EXPECT_THAT(message_types().names(), Contains("types_test/msg/Inner"));
}

TEST(MessageTypes, OfALibraryAreThoseItRegistersAndGenerates) {
  EXPECT_EQ(message_types().find("weather/msg/Wind"), nullptr);
  load_message_types(TAKT_WEATHER);
  const MessageType* wind = message_types().find("weather/msg/Wind");
  ASSERT_NE(wind, nullptr);
  EXPECT_EQ(wind->fields.size(), 2u);
  EXPECT_THAT(
      message_types().names(),
      testing::IsSupersetOf({"weather/msg/Station", "std_msgs/msg/Header",
                             "weather/srv/Calibrate_Request", "weather/srv/Calibrate_Response"}));
  load_message_types(TAKT_WEATHER);  // once more
  EXPECT_EQ(message_types().find("weather/msg/Wind"), wind);
}

TEST(MessageTypes, OfOneNameHaveOneLayout) {
  load_message_types(TAKT_WEATHER);
  const MessageType* wind = message_types().find("weather/msg/Wind");
  const std::string error = error_of([] { load_message_types(TAKT_OTHER_WEATHER); });
  EXPECT_THAT(error, HasSubstr("library '" TAKT_WEATHER "' and library '" TAKT_OTHER_WEATHER
                               "' register the message type weather/msg/Wind with different "
                               "layouts"));
  EXPECT_EQ(message_types().find("weather/msg/Wind"), wind);
}

TEST(MessageTypes, OfTheProgramHaveOneLayoutToo) {
  static const MessageType mine = detail::finish_message_type({.name = "a", .size = 1});
  static const MessageType same = detail::finish_message_type({.name = "a", .size = 1});
  static const MessageType other = detail::finish_message_type({.name = "a", .size = 2});
  static constexpr MessageTypes::Describe kMine[] = {[]() -> const MessageType& { return mine; },
                                                     []() -> const MessageType& { return same; }};
  static constexpr MessageTypes::Describe kOther[] = {[]() -> const MessageType& { return other; }};
  MessageTypes types;
  types.add(kMine);
  EXPECT_EQ(types.find("a"), &mine);
  types.add(kOther);
  const std::string error = error_of([&] { types.find("a"); });
  EXPECT_THAT(error,
              HasSubstr("the program registers the message type a with two different layouts"));
  EXPECT_EQ(error_of([&] { types.names(); }), error);  // it does not go away
}

TEST(MessageTypes, OfALibraryThatHasNoneAreAnError) {
  EXPECT_THAT(error_of([] { load_message_types("libm.so.6"); }),
              HasSubstr("library 'libm.so.6' registers no message type"));
  EXPECT_THAT(error_of([] { load_message_types("/nowhere/libnone.so"); }),
              HasSubstr("library '/nowhere/libnone.so' cannot be loaded"));
}

}  // namespace
}  // namespace takt::types_test
