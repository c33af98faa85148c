// Messages by bytes, inside a process: in both directions between an end that knows the type and
// one that does not.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/serve.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class GenericTest : public testing::Test {
 protected:
  SerializedCallback note() {
    return [this](std::span<const std::byte> bytes, const MessageInfo&) {
      std_msgs::msg::String message;
      ASSERT_TRUE(message_type<std_msgs::msg::String>().decode(bytes, &message));
      heard_.push_back(message.data);
    };
  }
  static ByteBuffer encoded(const std::string& text) {
    ByteBuffer bytes;
    const auto message = std_msgs::msg::String().set__data(text);
    message_type<std_msgs::msg::String>().encode(&message, bytes);
    return bytes;
  }
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
  std::vector<std::string> heard_;
};

TEST_F(GenericTest, WhatIsPublishedByTypeIsReceivedAsBytes) {
  for (const bool comes_first : {true, false}) {
    std::shared_ptr<SubscriptionBase> subscription;
    const auto subscribe = [&] {
      subscription =
          node_->create_generic_subscription("chatter", "std_msgs/msg/String", 5, note());
    };
    if (comes_first) subscribe();
    const auto publisher =
        node_->create_publisher<std_msgs::msg::String>("chatter", 5, {.loans = 2});
    if (!comes_first) subscribe();
    publisher->publish(std_msgs::msg::String().set__data("a"));
    publisher->publish(
        std::make_shared<const std_msgs::msg::String>(std_msgs::msg::String().set__data("b")));
    while (serve(*subscription)) {
    }
    EXPECT_THAT(heard_, ElementsAre("a", "b"));
    heard_.clear();
  }
}

TEST_F(GenericTest, TheBytesStayWhileTheCallbackSpinsAnExecutorThatServesOthers) {
  const auto inner = node_->create_generic_subscription("inner", "std_msgs/msg/String", 5, note());
  const auto outer = node_->create_generic_subscription(
      "outer", "std_msgs/msg/String", 5,
      [&](std::span<const std::byte> bytes, const MessageInfo& info) {
        EXPECT_TRUE(serve(*inner));
        note()(bytes, info);
      });
  node_->create_publisher<std_msgs::msg::String>("inner", 5)
      ->publish(std_msgs::msg::String().set__data("inner"));
  node_->create_publisher<std_msgs::msg::String>("outer", 5)
      ->publish(std_msgs::msg::String().set__data("outer"));
  EXPECT_TRUE(serve(*outer));
  EXPECT_THAT(heard_, ElementsAre("inner", "outer"));
}

TEST_F(GenericTest, WhatIsPublishedAsBytesIsReceivedByTypeAndAsBytes) {
  const auto bytewise =
      node_->create_generic_subscription("chatter", "std_msgs/msg/String", 5, note());
  std::string typed;
  const auto subscription = node_->create_subscription<std_msgs::msg::String>(
      "chatter", 5, [&](const std_msgs::msg::String& message) { typed = message.data; });
  const auto publisher = node_->create_generic_publisher("chatter", "std_msgs/msg/String", 5);
  EXPECT_EQ(publisher->subscription_count(), 2u);
  publisher->publish(encoded("x").bytes());
  EXPECT_TRUE(serve(*subscription));
  EXPECT_TRUE(serve(*bytewise));
  EXPECT_EQ(typed, "x");
  EXPECT_THAT(heard_, ElementsAre("x"));
}

TEST_F(GenericTest, WhatIsNoMessageIsDroppedAndCounted) {
  bool called = false;
  const auto subscription = node_->create_subscription<std_msgs::msg::String>(
      "chatter", 5, [&](const std_msgs::msg::String&) { called = true; });
  const auto publisher = node_->create_generic_publisher("chatter", "std_msgs/msg/String", 5);
  ByteBuffer bytes = encoded("text");
  publisher->publish(bytes.bytes().first(9));
  EXPECT_FALSE(serve(*subscription));
  EXPECT_FALSE(called);
  EXPECT_EQ(subscription->lost(), 1u);
  EXPECT_THAT([&] { publisher->publish(bytes.bytes().subspan(4)); },
              ThrowsMessage<Error>(HasSubstr("that are not a message")));
}

TEST_F(GenericTest, AnotherTypesNameIsRefused) {
  const auto publisher = node_->create_publisher<std_msgs::msg::String>("chatter", 5);
  EXPECT_THAT(
      [&] { (void)node_->create_generic_subscription("chatter", "std_msgs/msg/Bool", 5, note()); },
      ThrowsMessage<Error>(HasSubstr("carries std_msgs/msg/String")));
}

}  // namespace
}  // namespace takt
