// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/messages/std_msgs/msg/header.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

Time system_time() {
  return std::chrono::system_clock::now();
}

/// Sets the node's clock once, when it follows.
struct OneTime final : SimulatedClock::Source {
  void follow(const std::shared_ptr<SimulatedClock>& clock) override { clock->set(TimePoint(42s)); }
  void leave(const SimulatedClock&) noexcept override {}
};

// Nodes had the monotonic clock only, so that the obvious code sent the uptime as a stamp.
TEST(NodeTime, IsThatOfTheSystemSoThatOthersUnderstandStamps) {
  const auto node = std::make_shared<Node>("camera");
  const Time before = system_time();
  std_msgs::msg::Header header;
  header.stamp = node->now();
  EXPECT_LE(before, header.stamp);
  EXPECT_LE(header.stamp, system_time());
}

TEST(NodeTime, IsSimulatedWhileUseSimTimeIsTrue) {
  NodeOptions options;
  options.time_source = std::make_shared<OneTime>();
  const auto node = std::make_shared<Node>("camera", options);
  const Time before = system_time();
  EXPECT_LE(before, node->now());
  ASSERT_TRUE(node->set_parameters_atomically({{"use_sim_time", true}}).successful);
  EXPECT_EQ(node->now(), Time(42s));
  ASSERT_TRUE(node->set_parameters_atomically({{"use_sim_time", false}}).successful);
  EXPECT_LE(before, node->now());
}

TEST(NodeTime, IsThatOfAClockThatATestSets) {
  ManualClock manual;
  manual.advance(3s);
  NodeOptions options;
  options.clock = &manual;
  EXPECT_EQ(Node("camera", options).now(), Time(manual.now().time_since_epoch()));
  SimulatedClock simulated(manual);
  options.clock = &simulated;
  simulated.set(TimePoint(7s));
  EXPECT_EQ(Node("camera", options).now(), Time(7s));
}

}  // namespace
}  // namespace takt
