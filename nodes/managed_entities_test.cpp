// Tests of managed entities, which rest with their node.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/managed_entities.hpp"

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/lifecycle_node_test.hpp"

namespace takt::managed_entities_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using enum LifecycleState;

struct Scan {
  int id = 0;
};
TAKT_MESSAGE(Scan, "test_msgs/msg/Scan", id);

class RecordingSink final : public Sink {
 public:
  explicit RecordingSink(std::shared_ptr<Entity> entity) : entity_(std::move(entity)) {
    {
      const std::lock_guard lock(ownership_mutex());
      entity_->set_owner(this);
    }
    entity_->attach(*this);
  }
  ~RecordingSink() {
    if (entity_ != nullptr) entity_->leave_owner();
  }
  void announce(const Arrival&) noexcept override { ++announcements; }
  void release_changed() noexcept override { ++changes; }
  void expect_remove() noexcept override {}
  void remove() noexcept override {
    entity_->detach();
    entity_.reset();
  }

  int announcements = 0, changes = 0;

 private:
  std::shared_ptr<Entity> entity_;
};

// What an executor does, without one.
int run_all(Entity& entity) {
  int count = 0;
  for (Slot slot; entity.take(slot); ++count) entity.execute(slot);
  return count;
}

class ManagedEntities : public testing::Test {
 protected:
  void start() {
    ASSERT_TRUE(node_->configure());
    ASSERT_TRUE(node_->activate());
  }
  std::shared_ptr<Entity> entity(std::string_view name) { return node_->find_entity(name); }

  ManualClock clock_{TimePoint(1h)};
  const std::shared_ptr<TestNode> node_ = std::make_shared<TestNode>(NodeOptions{.clock = &clock_});
  const std::shared_ptr<Node> peer_ = std::make_shared<Node>("peer", NodeOptions{.clock = &clock_});
  const std::shared_ptr<Publisher<Scan>> scans_ =
      peer_->create_publisher<Scan>("scan", 10, {.loans = 8});
};

TEST_F(ManagedEntities, ATimerRunsInTheActiveStateOnlyAndBeginsItsPhaseThere) {
  int ran = 0;
  const auto timer = node_->create_timer("tick", 10ms, [&] { ++ran; });
  RecordingSink sink(entity("tick"));
  const auto rests = [&] {
    clock_.advance(25ms);
    EXPECT_EQ(timer->next_release(), kNever) << label(node_->get_current_state());
    EXPECT_EQ(timer->ready_count(), 0u);
    timer->reset();  // as a container does at its start
    EXPECT_EQ(timer->next_release(), kNever);
    timer->release_at(clock_.now());
    EXPECT_EQ(timer->next_release(), kNever);
    EXPECT_EQ(timer->ready_count(), 0u);
    EXPECT_EQ(run_all(*timer), 0);
  };
  rests();
  ASSERT_TRUE(node_->configure());
  rests();
  sink.changes = 0;
  ASSERT_TRUE(node_->activate());
  EXPECT_EQ(sink.changes, 1);
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
  clock_.advance(10ms);
  EXPECT_EQ(timer->ready_count(), 1u);
  EXPECT_EQ(run_all(*timer), 1);
  clock_.advance(9ms);
  sink.changes = 0;
  ASSERT_TRUE(node_->deactivate());
  EXPECT_EQ(sink.changes, 1);  // so that nobody wakes up for it
  rests();
  ASSERT_TRUE(node_->activate());
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
  clock_.advance(10ms);
  EXPECT_EQ(run_all(*timer), 1);
  ASSERT_TRUE(node_->shutdown());
  rests();
  EXPECT_EQ(ran, 2);
  EXPECT_EQ(timer->missed(), 0u);
}

TEST_F(ManagedEntities, ACancelledTimerStaysCancelled) {
  const auto timer = node_->create_timer("tick", 10ms, [] {});
  timer->cancel();
  start();
  EXPECT_EQ(timer->next_release(), kNever);
  EXPECT_TRUE(timer->is_canceled());
  timer->reset();
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
  ASSERT_TRUE(node_->deactivate());
  EXPECT_FALSE(timer->is_canceled());
  timer->cancel();
  ASSERT_TRUE(node_->activate());
  EXPECT_TRUE(timer->is_canceled());
  ASSERT_TRUE(node_->deactivate());
  timer->reset();
  ASSERT_TRUE(node_->activate());
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
}

TEST_F(ManagedEntities, ASubscriptionKeepsTheNewestMessagesUntilItsNodeIsActive) {
  std::vector<int> seen;
  const auto subscription = node_->create_subscription<Scan>(
      "scan", 3, [&](const Scan& scan) { seen.push_back(scan.id); });
  RecordingSink sink(entity("scan"));
  const auto rests = [&](int first) {
    for (int id = first; id < first + 5; ++id) scans_->publish(Scan{id});
    EXPECT_EQ(sink.announcements, 0) << label(node_->get_current_state());
    EXPECT_EQ(subscription->ready_count(), 0u);
    EXPECT_EQ(run_all(*subscription), 0);
    Scan scan;
    EXPECT_FALSE(subscription->take(scan));
  };
  rests(0);
  EXPECT_EQ(subscription->counts().expected, 2u);  // those that were overwritten
  EXPECT_EQ(subscription->counts().dropped, 2u);
  ASSERT_TRUE(node_->configure());
  rests(10);
  ASSERT_TRUE(node_->activate());
  EXPECT_EQ(sink.announcements, 1);
  EXPECT_EQ(subscription->ready_count(), 3u);
  EXPECT_EQ(run_all(*subscription), 3);
  EXPECT_THAT(seen, ElementsAre(12, 13, 14));
  EXPECT_EQ(subscription->counts().expected, 10u);
  scans_->publish(Scan{20});
  EXPECT_EQ(sink.announcements, 2);
  ASSERT_TRUE(node_->deactivate());
  sink.announcements = 0;
  rests(30);
  ASSERT_TRUE(node_->cleanup());
  rests(40);
  start();
  EXPECT_EQ(run_all(*subscription), 3);
  EXPECT_THAT(seen, ElementsAre(12, 13, 14, 42, 43, 44));
  ASSERT_TRUE(node_->shutdown());
  sink.announcements = 0;
  rests(50);
}

TEST_F(ManagedEntities, AnEmptySubscriptionIsNotAnnouncedOnActivation) {
  const auto subscription = node_->create_subscription<Scan>("scan", 3, [](const Scan&) {});
  RecordingSink sink(entity("scan"));
  start();
  EXPECT_EQ(sink.announcements, 0);
  scans_->publish(Scan{});
  EXPECT_EQ(sink.announcements, 1);
}

TEST_F(ManagedEntities, AnExecutorMayComeBeforeOrAfterActivation) {
  const auto subscription = node_->create_subscription<Scan>("scan", 3, [](const Scan&) {});
  start();
  scans_->publish(Scan{});
  RecordingSink sink(entity("scan"));
  EXPECT_EQ(subscription->ready_count(), 1u);
  scans_->publish(Scan{});
  EXPECT_EQ(sink.announcements, 1);
  subscription->leave_owner();
  ASSERT_TRUE(node_->deactivate());
  ASSERT_TRUE(node_->activate());  // there is no listener
  EXPECT_EQ(sink.announcements, 1);
}

TEST_F(ManagedEntities, EveryFormOfCallbackIsManaged) {
  int called = 0;
  const auto look = node_->create_subscription<Scan>("scan", 3, [&](const Scan&) { ++called; });
  const auto look_info = node_->create_subscription<Scan>(
      "scan", 3, [&](const Scan&, const MessageInfo&) { ++called; });
  const auto share =
      node_->create_subscription<Scan>("scan", 3, [&](std::shared_ptr<const Scan>) { ++called; });
  const auto share_info = node_->create_subscription<Scan>(
      "scan", 3, [&](const std::shared_ptr<const Scan>&, const MessageInfo&) { ++called; });
  const auto own =
      node_->create_subscription<Scan>("scan", 3, [&](std::unique_ptr<Scan>) { ++called; });
  const auto own_info = node_->create_subscription<Scan>(
      "scan", 3, [&](std::unique_ptr<Scan>, const MessageInfo&) { ++called; });
  scans_->publish(std::make_unique<Scan>());
  const auto run = [&] {
    for (const auto& each : node_->entities()) run_all(*each);
    return std::exchange(called, 0);
  };
  EXPECT_EQ(run(), 0);
  start();
  EXPECT_EQ(run(), 6);
}

TEST_F(ManagedEntities, APublisherPublishesInTheActiveStateOnly) {
  int received = 0;
  const auto subscription =
      peer_->create_subscription<Scan>("out", 20, [&](const Scan&) { ++received; });
  const auto publisher = node_->create_publisher<Scan>("out", 20, {.loans = 2});
  EXPECT_EQ(publisher->topic(), "/out");
  EXPECT_EQ(publisher->subscription_count(), 1u);
  const auto publish_all = [&] {
    publisher->publish(Scan{});
    publisher->publish(std::make_unique<Scan>());
    publisher->publish(std::make_shared<const Scan>());
    auto loan = publisher->borrow_loaned_message();
    EXPECT_TRUE(loan);  // the one that was not published came back
    publisher->publish(std::move(loan));
    run_all(*subscription);
    return std::exchange(received, 0);
  };
  EXPECT_FALSE(publisher->is_activated());
  EXPECT_EQ(publish_all(), 0);
  EXPECT_EQ(publish_all(), 0);
  EXPECT_EQ(publisher->suppressed(), 8u);
  start();
  EXPECT_TRUE(publisher->is_activated());
  EXPECT_EQ(publish_all(), 4);
  ASSERT_TRUE(node_->deactivate());
  EXPECT_EQ(publish_all(), 0);
  EXPECT_EQ(publisher->suppressed(), 12u);
}

TEST_F(ManagedEntities, APublisherWarnsOnceForEachTimeThatTheNodeIsNotActive) {
  std::mutex mutex;
  std::vector<std::string> lines;
  Logger::instance().flush();
  Logger::instance().set_writer([&](LogLevel, std::string_view line) {
    const std::lock_guard lock(mutex);
    if (line.find("/out") != std::string_view::npos) lines.emplace_back(line);
  });
  const auto publisher = node_->create_publisher<Scan>("out", 20);
  for (int i = 0; i < 3; ++i) publisher->publish(Scan{});
  start();
  publisher->publish(Scan{});
  ASSERT_TRUE(node_->deactivate());
  for (int i = 0; i < 3; ++i) publisher->publish(Scan{});
  Logger::instance().flush();
  Logger::instance().set_writer({});
  EXPECT_THAT(lines,
              ElementsAre(HasSubstr("/out: nothing is published, for the node is not active"),
                          HasSubstr("/out: nothing is published")));
}

TEST_F(ManagedEntities, WhatTheBaseClassCreatesAlwaysWorks) {
  int ran = 0;
  const auto timer = node_->Node::create_timer("tick", 10ms, [&] { ++ran; });
  const auto subscription =
      node_->Node::create_subscription<Scan>("scan", 3, [&](const Scan&) { ++ran; });
  const auto publisher = node_->Node::create_publisher<Scan>("scan", 10);
  clock_.advance(10ms);
  publisher->publish(Scan{});
  EXPECT_EQ(run_all(*timer) + run_all(*subscription), 2);
  EXPECT_EQ(ran, 2);
}

TEST_F(ManagedEntities, ATimerCreatedWhileActiveRuns) {
  start();
  const auto timer = node_->create_timer("tick", 10ms, [] {});
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
  const auto subscription = node_->create_subscription<Scan>("scan", 3, [](const Scan&) {});
  scans_->publish(Scan{});
  EXPECT_EQ(run_all(*subscription), 1);
}

TEST_F(ManagedEntities, AWallTimerRestsAsTheOthers) {
  int ran = 0;
  const auto timer = node_->create_wall_timer(10ms, [&] { ++ran; });
  clock_.advance(10ms);
  EXPECT_EQ(run_all(*timer), 0);
  start();
  clock_.advance(10ms);
  EXPECT_EQ(run_all(*timer), 1);
  EXPECT_EQ(ran, 1);
}

TEST_F(ManagedEntities, RestDuringTheCallbacksOfTransitions) {
  int ran = 0;
  const auto timer = node_->create_timer("tick", 10ms, [&] { ++ran; });
  const auto try_to_run = [&] {
    clock_.advance(20ms);
    EXPECT_EQ(run_all(*timer), 0);
    return CallbackReturn::SUCCESS;
  };
  node_->actions[activating] = node_->actions[deactivating] = try_to_run;
  start();
  clock_.advance(10ms);
  EXPECT_EQ(run_all(*timer), 1);
  clock_.advance(10ms);
  ASSERT_TRUE(node_->deactivate());
}

TEST_F(ManagedEntities, GoOnWhenDeactivationFails) {
  const auto timer = node_->create_timer("tick", 10ms, [] {});
  node_->actions[deactivating] = [] { return CallbackReturn::FAILURE; };
  start();
  clock_.advance(7ms);
  EXPECT_EQ(node_->deactivate().state, active);
  EXPECT_EQ(timer->next_release(), clock_.now() + 10ms);
}

TEST_F(ManagedEntities, RestAfterAnError) {
  const auto timer = node_->create_timer("tick", 10ms, [] {});
  node_->actions[deactivating] = [] { return CallbackReturn::ERROR; };
  node_->actions[errorprocessing] = [] { return CallbackReturn::SUCCESS; };
  start();
  EXPECT_EQ(node_->deactivate().state, unconfigured);
  EXPECT_EQ(timer->next_release(), kNever);
}

TEST_F(ManagedEntities, ACallbackMayDeactivateItsOwnNode) {
  TransitionResult result;
  const auto timer = node_->create_timer("tick", 10ms, [&] { result = node_->deactivate(); });
  start();
  clock_.advance(10ms);
  EXPECT_EQ(run_all(*timer), 1);
  EXPECT_TRUE(result);
  EXPECT_EQ(timer->next_release(), kNever);
}

// Logical execution time: inputs are taken together.
TEST_F(ManagedEntities, WhatWasTakenBeforeADeactivationOnTheSameThreadDoesNotRun) {
  int ran = 0;
  const auto timer = node_->create_timer("tick", 10ms, [&] {
    ++ran;
    EXPECT_TRUE(node_->deactivate());
  });
  const auto subscription =
      node_->create_subscription<Scan>("scan", 3, [&](const Scan&) { ++ran; });
  start();
  clock_.advance(10ms);
  auto loan = scans_->borrow_loaned_message();
  scans_->publish(std::move(loan));
  Slot tick, scan;
  ASSERT_TRUE(timer->take(tick));
  ASSERT_TRUE(subscription->take(scan));
  timer->execute(tick);
  subscription->execute(scan);
  EXPECT_EQ(ran, 1);
  std::vector<LoanedMessage<Scan>> all;
  for (int i = 0; i < 8; ++i) all.push_back(scans_->borrow_loaned_message());
  EXPECT_TRUE(all.back());  // its message was given back
}

TEST_F(ManagedEntities, ACallbackThatThrowsHasEnded) {
  const auto timer = node_->create_timer("tick", 10ms, [] { throw std::runtime_error("x"); });
  start();
  clock_.advance(10ms);
  EXPECT_THROW(run_all(*timer), std::runtime_error);
  EXPECT_TRUE(node_->deactivate());  // would wait for ever
}

TEST_F(ManagedEntities, DispatchAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto subscription = node_->create_subscription<Scan>("scan", 3, [](const Scan&) {});
  const auto publisher = node_->create_publisher<Scan>("scan", 10, {.loans = 4});
  start();
  { const ReadSection registers_this_thread; }  // as executor threads do before they spin
  const RealtimeScope scope;
  for (int i = 0; i < 100; ++i) {
    publisher->publish(publisher->borrow_loaned_message());
    run_all(*subscription);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST_F(ManagedEntities, MayBeDroppedInAnyState) {
  for (int round = 0; round < 3; ++round) {
    auto timer = node_->create_timer("tick", 10ms, [] {});
    auto subscription = node_->create_subscription<Scan>("scan", 3, [](const Scan&) {});
    auto publisher = node_->create_publisher<Scan>("out", 3);
    scans_->publish(Scan{});
    if (round == 0) {
      ASSERT_TRUE(node_->configure());
    }
    if (round == 1) {
      ASSERT_TRUE(node_->activate());
    }
  }
  ASSERT_TRUE(node_->deactivate());
  EXPECT_THAT(node_->entities(), IsEmpty());
}

TEST_F(ManagedEntities, ATimersNameIsChecked) {
  EXPECT_THROW((void)node_->create_timer("2", 10ms, [] {}), Error);
}

}  // namespace
}  // namespace takt::managed_entities_test
