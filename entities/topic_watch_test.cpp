// What is said of a publisher and a subscription in two processes that do not match.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <mutex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/logger.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/rmw_dds_common/msg/participant_entities_info.hpp"
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
  static std::shared_ptr<Participant> join(RosGraph form = RosGraph::jazzy) {
    DdsOptions options;
    options.domain = test_domain();
    options.shared_memory = SharedMemory::off;
    options.ros_graph = form;
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

// Ends of ROS 2 say nothing of their nodes; nor do Takt's in Humble's form. 15 of 15 lines had no
// name.
TEST_F(TopicWatchTest, WhoseNodeOnlyItsProcessAnnouncesIsNamed) {
  const auto here = join(RosGraph::humble), there = join(RosGraph::humble);
  here->add_node("/listener");
  there->add_node("/talker");
  const auto talks = there->create_writer(
      {"/announced", &message_type<std_msgs::msg::String>(), QoS(1), "/talker", {}});
  const Reader listens(
      *here, Endpoint{"/announced", &message_type<std_msgs::msg::Bool>(), QoS(1), "/listener", {}});
  const auto said = lines("/announced", 2);
  ASSERT_EQ(said.size(), 2u);
  for (const auto& [level, text] : said) {
    EXPECT_THAT(text, AllOf(HasSubstr("the publisher of node '/talker'"),
                            HasSubstr("the subscription of node '/listener'")));
  }
}

/// The 16 bytes of "01.10.…".
std::array<std::uint8_t, 16> gid_of(const std::string& text) {
  std::array<std::uint8_t, 16> gid{};
  for (std::size_t i = 0; i < gid.size(); ++i) {
    gid[i] = static_cast<std::uint8_t>(std::stoul(text.substr(3 * i, 2), nullptr, 16));
  }
  return gid;
}

/// A process of ROS 2 whose endpoint is known before its nodes are.
class LateNamesTest : public TopicWatchTest {
 protected:
  LateNamesTest() {
    EXPECT_TRUE(eventually([&] {
      for (const GraphEndpoint& end : local_->graph().publishers) {
        if (end.name == "/late") gid_ = end.gid;
      }
      return !gid_.empty();
    }));
    announces_ =
        there_->create_writer({"ros_discovery_info",
                               &message_type<rmw_dds_common::msg::ParticipantEntitiesInfo>(),
                               QoS(1).transient_local(),
                               "",
                               {}});
    EXPECT_TRUE(eventually([&] { return announces_->reader_count() != 0; }));
  }
  /// Nodes, of which the first has the endpoint.
  void announce(std::size_t nodes = 1, const std::string& name_space = "/") {
    rmw_dds_common::msg::ParticipantEntitiesInfo info;
    info.gid.data = gid_of(gid_);
    std::copy_n(std::begin({0, 0, 1, 0xc1}), 4, info.gid.data.begin() + 12);  // its participant
    info.node_entities_info_seq.resize(nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
      info.node_entities_info_seq[i].node_namespace = name_space;
      info.node_entities_info_seq[i].node_name = i == 0 ? "talker" : fmt::format("n{}", i);
    }
    info.node_entities_info_seq[0].writer_gid_seq.resize(1);
    info.node_entities_info_seq[0].writer_gid_seq[0].data = gid_of(gid_);
    announces_->write(&info, {});
  }
  std::size_t unnamed() {
    Logger::instance().flush();
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(
        std::count_if(lines_.begin(), lines_.end(), [](const auto& line) {
          return line.second.find("of a node whose name is not known in another process") !=
                 std::string::npos;
        }));
  }

  std::shared_ptr<Participant> local_ = join();
  const std::unique_ptr<RemoteWriter> talks_ =
      there_->create_writer({"/late", &message_type<std_msgs::msg::String>(), QoS(1), "", {}});
  std::unique_ptr<RemoteWriter> announces_;
  std::string gid_;
};

TEST_F(LateNamesTest, ALineIsCompletedByTheAnnouncement) {
  const Reader listens(
      *local_, Endpoint{"/late", &message_type<std_msgs::msg::Bool>(), QoS(1), "/listener", {}});
  announce();
  const auto said = lines("/late", 2);  // of there_, too
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(unnamed(), 0u);
  EXPECT_TRUE(std::any_of(said.begin(), said.end(), [](const auto& line) {
    return line.second.find("the publisher of node '/talker' in another") != std::string::npos;
  }));
}

TEST_F(LateNamesTest, ALineWhoseNameNeverComesIsLoggedWithout) {
  const Reader listens(
      *local_, Endpoint{"/late", &message_type<std_msgs::msg::Bool>(), QoS(1), "/listener", {}});
  EXPECT_TRUE(eventually([&] { return unnamed() == 1; }));
}

TEST_F(LateNamesTest, ALineThatWaitsIsLoggedAtTheEnd) {
  auto listens = std::make_unique<Reader>(
      *local_, Endpoint{"/late", &message_type<std_msgs::msg::Bool>(), QoS(1), "/listener", {}});
  listens.reset();
  local_.reset();
  EXPECT_EQ(unnamed(), 1u);
}

TEST_F(LateNamesTest, OfMoreNodesThanTheLimitTheGraphHasSome) {
  for (const std::size_t count : {kMostEntries, kMostEntries + 1}) {
    const std::string name_space = fmt::format("/of_{}", count);
    announce(count, name_space);
    Graph graph;
    ASSERT_TRUE(eventually([&] {
      graph = local_->graph();
      return !graph.nodes.empty() && graph.nodes[0].starts_with(name_space + "/");
    }));
    EXPECT_EQ(graph.nodes.size(), kMostEntries);
  }
}

}  // namespace
}  // namespace takt
