// Tests of what other threads ask a subscription while it retires.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "takt/nodes/node.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/outside.hpp"

namespace takt {
namespace {

struct Level {
  int metres = 0;
};
TAKT_MESSAGE(Level, "test_msgs/msg/Level", metres);

// A reentrant service that one callback drops is asked by another one that answers: the remote
// reader was destroyed under its hands. (This test once polled `is_inside`, which is set back after
// 10 ms: on a busy machine it missed that, and hung.)
TEST(Subscription, LeavesNobodyInsideItsEndOutsideWhenItRetires) {
  const auto outside = std::make_shared<Outside>();
  Node node("node", {.participant = outside});
  auto handle = node.create_subscription<Level>("level", 10, [](const Level&) {});
  const std::shared_ptr<Entity> kept = node.entities().front();  // as executors do
  std::thread asks([&asked = *handle] { asked.outside_publisher_count(); });
  EXPECT_TRUE(eventually([&] { return outside->is_asked.load(); }));
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
    EXPECT_EQ(kept->counts().from_outside, 7u);
    has_begun.store(true);
    EXPECT_TRUE(eventually([&] { return kept->counts().from_outside == 0; }));
  });
  EXPECT_TRUE(eventually([&] { return has_begun.load(); }));
  handle.reset();
  reports.join();
}

}  // namespace
}  // namespace takt
