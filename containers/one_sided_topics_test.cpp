// Which topics are said to have one side only, and what the file can demand of them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/one_sided_topics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/logger.hpp"
#include "takt/containers/container.hpp"
#include "takt/testing/peer_process.hpp"

namespace takt::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Count {
  int number = 0;
};
TAKT_MESSAGE(Count, "test/msg/Count", number);

/// "/lone > /node": published by it; "<": subscribed to.
std::vector<std::string> one_sided(Participant* participant = nullptr) {
  std::vector<std::string> texts;
  for (const OneSidedTopic& topic : one_sided_topics(participant)) {
    for (const std::string& node : topic.nodes) {
      texts.push_back(topic.name + (topic.is_published ? " > " : " < ") + node);
    }
  }
  return texts;
}

TEST(OneSidedTopics, HaveOneSideUntilTheOtherComes) {
  const auto node = std::make_shared<Node>("node");
  EXPECT_THAT(one_sided(), IsEmpty());
  auto publisher = node->create_publisher<Count>("/lone", 1);
  EXPECT_THAT(one_sided(), ElementsAre("/lone > /node"));
  const auto subscription = node->create_subscription<Count>("/lone", 1, [](const Count&) {});
  EXPECT_THAT(one_sided(), IsEmpty());
  publisher.reset();
  EXPECT_THAT(one_sided(), ElementsAre("/lone < /node"));
}

TEST(OneSidedTopics, OthersOnTheDomainAreTheOtherSide) {
  DdsOptions options;
  options.domain = test_domain();
  options.shared_memory = SharedMemory::off;
  NodeOptions here;
  here.participant = Participant::create(options);
  const auto there = Participant::create(options);
  const auto node = std::make_shared<Node>("node", here);
  const auto heard = node->create_subscription<Count>("/heard", 1, [](const Count&) {});
  const auto sent = node->create_publisher<Count>("/sent", 1);
  EXPECT_THAT(one_sided(here.participant.get()), ElementsAre("/heard < /node", "/sent > /node"));
  // Without a node: of another process, as far as this one knows.
  const Endpoint of_other{"/heard", &message_type<Count>(), QoS(1), "/other", {}};
  const auto writer = there->create_writer(of_other, std::make_shared<EndpointEvents>());
  EXPECT_TRUE(eventually([&] { return one_sided(here.participant.get()).size() == 1; }));
  EXPECT_THAT(one_sided(here.participant.get()), ElementsAre("/sent > /node"));
}

TEST(OneSidedTopics, AreHintedAtWhereAUserMayHaveErred) {
  EXPECT_EQ(hint_at({{"/rosout", true, {"/a"}},
                     {"/a/transition_event", true, {"/a"}},
                     {"/walk/_action/status", true, {"/a"}}}),
            "");
  EXPECT_EQ(
      hint_at({{"/map", true, {"/a"}}, {"/rosout", true, {"/a"}}, {"/scan", false, {"/b", "/c"}}}),
      "topics without publisher or without subscription: '/map' (no subscription; published by "
      "/a), '/scan' (no publisher; subscribed by /b, /c)");
  EXPECT_THAT(hint_at(std::vector<OneSidedTopic>(12, {"/map", true, {"/a"}})),
              HasSubstr(", and 2 more"));
}

/// Subscribes to what nobody publishes.
class Listener : public Node {
 public:
  explicit Listener(const NodeOptions& options) : Node("listener", options) {}

 private:
  std::shared_ptr<Subscription<Count>> subscription_ =
      create_subscription<Count>("scan", 1, [](const Count&) {});
};

SystemDescription listening() {
  SystemDescription system;
  system.file = "test.yaml";
  system.components.push_back({.type = "takt::test::Listener", .where = "test.yaml:3"});
  system.must_match["/scan"] = "test.yaml:6";
  return system;
}

/// The failures of a run in which `act` comes between release and hold.
template <class Act>
std::vector<std::string> failures(Act&& act) {
  Container container(listening());
  container.start();
  container.release();
  act(container);
  container.hold();
  container.stop();
  return container.result().failures;
}

constexpr const char* kFailure =
    "test.yaml:6: topic '/scan' must match: no publisher; subscribed by /listener";

// In one of several containers: nobody could say at its start that the name is wrong.
TEST(OneSidedTopics, ThatMustMatchFailTheRunWhenNobodyHasThem) {
  SystemDescription system = listening();
  system.must_match = {{"/scam", "test.yaml:6"}};
  Container container(system);
  container.start();
  container.release();
  container.hold();
  container.stop();
  EXPECT_THAT(container.result().failures,
              ElementsAre("test.yaml:6: topic '/scam' must match: it has no publisher and no "
                          "subscription; check its name"));
}

// They were reported after ten seconds of a run only.
TEST(OneSidedTopics, AreNotedAtTheEndOfEachRun) {
  SystemDescription system = listening();
  system.must_match.clear();
  Container container(system);
  container.start();
  container.release();
  container.hold();
  container.stop();
  EXPECT_THAT(container.result().notes,
              ElementsAre("topics without publisher or without subscription: '/scan' (no "
                          "publisher; subscribed by /listener)"));
}

TEST(OneSidedTopics, ThatMustMatchFailTheRunOnce) {
  EXPECT_THAT(failures([](Container& container) { container.check_matches(); }),
              ElementsAre(kFailure));
  EXPECT_THAT(failures([](Container&) {}), ElementsAre(kFailure));  // at its end at the latest
  const auto other = std::make_shared<Node>("other");
  const auto publisher = other->create_publisher<Count>("/scan", 1);
  EXPECT_THAT(failures([](Container& container) { container.check_matches(); }), IsEmpty());
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::Listener)
