// Tests of the user's own loop: what is ready, and what happens to entities that go.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_set.hpp"

#include <atomic>
#include <cstdlib>
#include <future>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test_msgs/msg/Number", value);

std::vector<std::string> names(const std::vector<std::shared_ptr<Entity>>& entities) {
  std::vector<std::string> result;
  for (const auto& entity : entities) result.push_back(entity->name());
  return result;
}

TEST(WaitSet, ListsWhatIsReadyInTheOrderOfAddUntilItIsTaken) {
  const auto node = std::make_shared<Node>("node");
  const auto first = node->create_subscription<Number>("first", 1, [](const Number&) {});
  const auto second = node->create_subscription<Number>("second", 1, [](const Number&) {});
  const auto to_first = node->create_publisher<Number>("first", 1);
  const auto to_second = node->create_publisher<Number>("second", 1);
  WaitSet set;
  set.add(first);
  set.add(second);
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  to_second->publish(Number{2});
  to_first->publish(Number{1});
  EXPECT_THAT(names(set.wait()), ElementsAre("first", "second"));
  Number number;
  EXPECT_TRUE(first->take(number));
  EXPECT_EQ(number.value, 1);
  EXPECT_THAT(names(set.wait()), ElementsAre("second"));
  EXPECT_TRUE(second->take(number));
  EXPECT_THAT(set.wait(0ns), IsEmpty());
}

// The thread that waited did not learn of it before its time-out.
TEST(WaitSet, AnAdditionWakesTheThreadThatWaits) {
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard");
  const auto timer = node->create_wall_timer(1ms, [] {});
  guard->trigger();
  for (const std::shared_ptr<Entity>& added :
       {std::shared_ptr<Entity>(guard), std::shared_ptr<Entity>(timer)}) {
    WaitSet set;
    // Longer than the test waits: at its end it finds what is ready by looking.
    auto waits = std::async(std::launch::async, [&] { return names(set.wait(1h)); });
    EXPECT_EQ(waits.wait_for(10ms), std::future_status::timeout);
    set.add(added);
    if (waits.wait_for(1min) != std::future_status::ready) std::abort();
    EXPECT_THAT(waits.get(), ElementsAre(added->name()));
  }
}

TEST(WaitSet, IsWokenFromAnotherThread) {
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard");
  WaitSet set;
  set.add(guard);
  std::jthread other([&] { guard->trigger(); });
  EXPECT_THAT(names(set.wait()), ElementsAre("guard"));
}

TEST(WaitSet, RefusesWhatAnExecutorHas) {
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard", [] {});
  const auto executor = executors().make("events", ExecutorOptions{});
  executor->add_node(node);
  executor->spin_some();
  WaitSet set;
  EXPECT_THAT([&] { set.add(guard); }, ThrowsMessage<Error>(HasSubstr("'guard' belongs to an")));
}

TEST(WaitSet, HoldsWhatItHasUntilItIsRemoved) {
  const auto node = std::make_shared<Node>("node");
  auto guard = node->create_guard_condition("guard");
  const std::weak_ptr<Entity> entity = node->entities().front();
  WaitSet set;
  set.add(guard);
  guard->trigger();
  guard.reset();
  EXPECT_THAT(names(set.wait()), ElementsAre("guard"));
  set.remove(set.wait().front());
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  EXPECT_TRUE(entity.expired());
}

TEST(WaitSet, EntitiesComeAndGoOnAnotherThreadWhileItWaits) {
  const auto node = std::make_shared<Node>("node");
  const auto steady = node->create_guard_condition("steady");
  WaitSet set;
  set.add(steady);
  std::atomic<bool> stop{false};
  std::jthread other([&] {
    for (int round = 0; round < 200; ++round) {
      const auto guest = node->create_guard_condition("guest");
      set.add(guest);
      guest->trigger();
      set.remove(guest);
    }
    stop.store(true);
    steady->trigger();
  });
  while (!stop.load()) set.wait();
  EXPECT_THAT(names(set.wait()), testing::Contains("steady"));
}

TEST(WaitSet, ServesFileDescriptors) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_NONBLOCK | O_CLOEXEC), 0);
  const auto node = std::make_shared<Node>("node");
  const auto reader = node->create_file_descriptor("pipe", ends[0], FileDescriptorEvents::readable,
                                                   [](FileDescriptorEvents) {});
  WaitSet set;
  set.add(reader);
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  std::jthread other([&] { EXPECT_EQ(write(ends[1], "ab", 2), 2); });
  EXPECT_THAT(names(set.wait()), ElementsAre("pipe"));
  other.join();
  for (int i = 0; i < 2; ++i) {  // what is not read is ready again
    EXPECT_THAT(names(set.wait()), ElementsAre("pipe"));
    char byte = 0;
    EXPECT_EQ(read(ends[0], &byte, 1), 1);
  }
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  set.remove(reader);
  EXPECT_EQ(write(ends[1], "x", 1), 1);
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  close(ends[0]);
  close(ends[1]);
}

// The set went while another thread was still removing an entity from it.
TEST(WaitSet, GoesWhileItsEntitiesAreDropped) {
  const auto node = std::make_shared<Node>("node");
  for (int round = 0; round < 300; ++round) {
    auto first = node->create_guard_condition("first");
    auto second = node->create_guard_condition("second");
    auto set = std::make_unique<WaitSet>();
    set->add(first);
    set->add(second);
    std::jthread dropper([&] {
      first.reset();
      second.reset();
    });
    set.reset();
  }
}

// What the last result destroyed went under the set's lock, which removing a member takes.
TEST(WaitSet, MayBeUsedByWhatGoesWithItsLastResult) {
  const auto node = std::make_shared<Node>("node");
  const auto group =
      node->create_callback_group("group", CallbackGroupType::MutuallyExclusive, false);
  WaitSet set;
  const auto stays = node->create_guard_condition("stays", {}, group);
  set.add(stays);
  std::shared_ptr<void> removes(nullptr, [&](void*) { set.remove(stays); });
  const std::weak_ptr<void> is_owned = removes;
  auto goes = node->create_guard_condition(
      "goes", [owned = std::move(removes)] {}, group);
  set.add(goes);
  goes->trigger();
  EXPECT_THAT(names(set.wait()), ElementsAre("goes"));
  set.remove(goes);
  goes.reset();
  EXPECT_FALSE(is_owned.expired());  // the result has the last pointer to it
  EXPECT_THAT(set.wait(0ns), IsEmpty());
  EXPECT_TRUE(is_owned.expired());
}

}  // namespace
}  // namespace takt
