// Tests of what other threads ask a subscription while it retires.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "takt/nodes/node.hpp"
#include "takt/testing/outside.hpp"

namespace takt {
namespace {

struct Level {
  int metres = 0;
};
TAKT_MESSAGE(Level, "test_msgs/msg/Level", metres);

// A reentrant service that one callback drops is asked by another one that answers: the end outside
// was destroyed under its hands.
TEST(Subscription, LeavesNobodyInsideItsEndOutsideWhenItRetires) {
  const auto outside = std::make_shared<Outside>();
  Node node("node", {.participant = outside});
  auto handle = node.create_subscription<Level>("level", 10, [](const Level&) {});
  const std::shared_ptr<Entity> kept = node.entities().front();  // as executors do
  std::thread asks([&asked = *handle] { asked.outside_publisher_count(); });
  while (!outside->is_inside.load()) std::this_thread::yield();
  handle.reset();
  EXPECT_TRUE(outside->is_gone);
  EXPECT_FALSE(outside->went_inside);
  asks.join();
}

// An executor reports of what is being removed. For the thread sanitizer.
TEST(Subscription, ReportsWhileItRetires) {
  const auto outside = std::make_shared<Outside>();
  Node node("node", {.participant = outside});
  auto handle = node.create_subscription<Level>("level", 10, [](const Level&) {});
  const std::shared_ptr<Entity> kept = node.entities().front();
  std::atomic<bool> has_begun{false};
  std::thread reports([&] {
    EXPECT_EQ(kept->report().from_outside, 7u);
    has_begun.store(true);
    while (kept->report().from_outside != 0) {
    }
  });
  while (!has_begun.load()) std::this_thread::yield();
  handle.reset();
  reports.join();
}

}  // namespace
}  // namespace takt
