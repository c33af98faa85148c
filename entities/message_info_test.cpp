// What a subscription learns of a message beside its content, and a publisher of its way.
// SPDX-License-Identifier: Apache-2.0
#include <csignal>

#include <gtest/gtest.h>

#include "takt/testing/peer_process.hpp"
#include "takt/testing/serve.hpp"
#include "takt/testing/transport_messages.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

std::shared_ptr<Node> make_node(const char* name, bool serves_own_process) {
  const DdsOptions dds{.domain = test_domain(),
                       .serves_own_process = serves_own_process,
                       .shared_memory = SharedMemory::off};
  return std::make_shared<Node>(name, NodeOptions{.participant = Participant::create(dds)});
}

TEST(MessageInfo, SaysWhenAndByWhichPublisherAMessageFromOutsideWasPublished) {
  const auto here = make_node("here", true), there = make_node("there", true);
  std::vector<MessageInfo> infos;
  const auto subscription = here->create_subscription<Labelled>(
      "topic", 10, [&](const Labelled&, const MessageInfo& info) { infos.push_back(info); });
  const auto one = there->create_publisher<Labelled>("topic", 10);
  const auto other = there->create_publisher<Labelled>("topic", 10);
  ASSERT_TRUE(
      eventually([&] { return one->subscription_count() + other->subscription_count() == 2; }));
  const auto before = std::chrono::system_clock::now();
  for (const auto& publisher : {one, one, other}) {
    const std::size_t count = infos.size();
    publisher->publish(Labelled{});
    ASSERT_TRUE(eventually([&] { return serve(*subscription) && infos.size() == count + 1; }));
  }
  const auto after = std::chrono::system_clock::now();
  auto last = before;
  for (const MessageInfo& info : infos) {
    EXPECT_GE(info.source_time, last);
    last = info.source_time;
  }
  EXPECT_LE(last, after);
  EXPECT_NE(infos[0].writer, 0u);
  EXPECT_EQ(infos[1].writer, infos[0].writer);
  EXPECT_NE(infos[2].writer, infos[0].writer);
}

TEST(MessageInfo, OfAMessageOfThisProcessHasNoWriter) {
  const auto node = make_node("node", false);
  std::vector<MessageInfo> infos;
  const auto subscription = node->create_subscription<Labelled>(
      "topic", 10, [&](const Labelled&, const MessageInfo& info) { infos.push_back(info); });
  node->create_publisher<Labelled>("topic", 10)->publish(Labelled{});
  ASSERT_TRUE(serve(*subscription));
  EXPECT_EQ(infos.at(0).writer, 0u);
  EXPECT_EQ(infos.at(0).source_time, std::chrono::system_clock::time_point{});
}

TEST(Publisher, WaitsUntilAllHaveConfirmed) {
  const auto node = make_node("node", false);
  const auto publisher = node->create_publisher<Labelled>("heard", 10);
  EXPECT_TRUE(publisher->wait_for_all_acked(0ns));
  const PeerProcess peer(TAKT_TRANSPORT_PEER, std::to_string(test_domain()));
  ASSERT_EQ(peer.ask("subscribe heard 10"), "ok");
  ASSERT_TRUE(eventually([&] { return publisher->subscription_count() == 1; }));
  peer.stop();
  publisher->publish(Labelled{.value = 1});
  EXPECT_FALSE(publisher->wait_for_all_acked(20ms));
  kill(peer.pid(), SIGCONT);
  EXPECT_TRUE(publisher->wait_for_all_acked(30s));
  EXPECT_EQ(peer.ask("last heard"), "1");
}

}  // namespace
}  // namespace takt
