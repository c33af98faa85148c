// What is said of a publisher and a subscription in two processes that do not match.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/logger.hpp"
#include "takt/messages/std_msgs/msg/bool.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Two participants of one process, without Node, so that nobody compares their ends inside it.
class TopicWatchTest : public testing::Test {
 protected:
  TopicWatchTest() {
    Logger::instance().set_writer([this](LogLevel level, std::string_view text) {
      const std::lock_guard lock(mutex_);
      lines_.emplace_back(level, text);
    });
  }
  ~TopicWatchTest() override {
    Logger::instance().flush();
    Logger::instance().set_writer({});
  }
  static std::shared_ptr<Participant> join() {
    DdsOptions options;
    options.domain = test_domain();
    options.shared_memory = SharedMemory::off;
    return Participant::create(options);
  }
  template <class T>
  std::unique_ptr<RemoteWriter> writer(const std::string& topic, const QoS& qos = 1) {
    return there_->create_writer({topic, &message_type<T>(), qos, "/talker", {}});
  }
  /// The end inside the process, and that outside it.
  struct Reader {
    Reader(Participant& participant, Endpoint endpoint)
        : inner(std::move(endpoint)), outer(participant.create_reader(inner)) {}
    IntraProcessReader inner;
    std::unique_ptr<RemoteReader> outer;
  };
  template <class T>
  std::unique_ptr<Reader> reader(const std::string& topic, const QoS& qos = 1) {
    return std::make_unique<Reader>(*here_,
                                    Endpoint{topic, &message_type<T>(), qos, "/listener", {}});
  }
  /// Waits until so many lines of the topic are there, and returns them.
  std::vector<std::pair<LogLevel, std::string>> lines(const std::string& topic, std::size_t count) {
    std::vector<std::pair<LogLevel, std::string>> found;
    EXPECT_TRUE(eventually([&] {
      found.clear();
      const std::lock_guard lock(mutex_);
      for (const auto& line : lines_) {
        if (line.second.find("topic '" + topic + "'") != std::string::npos) found.push_back(line);
      }
      return found.size() >= count;
    })) << topic;
    return found;
  }

  const std::shared_ptr<Participant> here_ = join(), there_ = join();
  std::mutex mutex_;
  std::vector<std::pair<LogLevel, std::string>> lines_;
};

// DDS matches no ends of different types, and nobody said so: both sides waited for ever.
TEST_F(TopicWatchTest, DifferentTypesAreAnErrorOnBothSides) {
  const auto talks = writer<std_msgs::msg::String>("/mixed");
  const auto listens = reader<std_msgs::msg::Bool>("/mixed");
  const auto said = lines("/mixed", 2);
  ASSERT_EQ(said.size(), 2u);
  for (const auto& [level, text] : said) {
    EXPECT_EQ(level, LogLevel::error);
    EXPECT_THAT(text, AllOf(HasSubstr("std_msgs/msg/String for the publisher of node '/talker'"),
                            HasSubstr("std_msgs/msg/Bool for the subscription of node '/listener'"),
                            HasSubstr("in another process")));
  }
}

TEST_F(TopicWatchTest, AnIncompatiblePolicyIsNamedWithBothEnds) {
  const auto listens = reader<std_msgs::msg::Bool>("/latched", QoS(1).transient_local());
  const auto talks = writer<std_msgs::msg::Bool>("/latched", QoS(1));
  const auto said = lines("/latched", 2);
  ASSERT_EQ(said.size(), 2u);
  for (const auto& [level, text] : said) {
    EXPECT_EQ(level, LogLevel::warn);
    EXPECT_THAT(text, AllOf(HasSubstr("the publisher of node '/talker'"),
                            HasSubstr("the subscription of node '/listener'"),
                            HasSubstr("asks for: durability")));
  }
}

// Two containers of one name did both what one was asked to do, or one of them, and nobody said so.
TEST_F(TopicWatchTest, AServiceOfTwoProcessesIsReportedOnBothSidesOnceForEachNode) {
  const auto serve = [](Participant& participant, const char* service, const char* node) {
    return std::make_unique<Reader>(participant,
                                    Endpoint{std::string("rq/imu/") + service + "Request",
                                             &message_type<std_msgs::msg::Bool>(),
                                             QoS(1),
                                             node,
                                             {}});
  };
  const auto here = serve(*here_, "get_parameters", "/imu");
  const auto there = serve(*there_, "get_parameters", "/other");
  const auto more_here = serve(*here_, "set_parameters", "/imu");
  const auto more_there = serve(*there_, "set_parameters", "/other");
  const auto wrong = reader<std_msgs::msg::String>("/last");
  const auto last = writer<std_msgs::msg::Bool>("/last");
  ASSERT_EQ(lines("/last", 2).size(), 2u);  // what has come before is known then
  const std::lock_guard lock(mutex_);
  const auto count = [&](const std::string& text) {
    return std::count_if(lines_.begin(), lines_.end(), [&](const auto& line) {
      return line.second.find(text) != std::string::npos;
    });
  };
  EXPECT_EQ(
      count("is served by node '/imu' here, and by node '/other' in another process: both get"), 1);
  EXPECT_EQ(
      count("is served by node '/other' here, and by node '/imu' in another process: both get"), 1);
}

TEST_F(TopicWatchTest, WhatFitsIsNotMentionedAndEachPairOnce) {
  const auto listens = reader<std_msgs::msg::Bool>("/fits");
  const auto talks = writer<std_msgs::msg::Bool>("/fits");
  ASSERT_TRUE(eventually([&] { return talks->reader_count() == 1; }));
  const auto wrong = reader<std_msgs::msg::String>("/last");
  const auto last = writer<std_msgs::msg::Bool>("/last");
  ASSERT_EQ(lines("/last", 2).size(), 2u);
  const auto another = reader<std_msgs::msg::String>("/last");
  ASSERT_EQ(lines("/last", 4).size(), 4u);  // the new one, on both sides
  EXPECT_TRUE(lines("/fits", 0).empty());
}

}  // namespace
}  // namespace takt
