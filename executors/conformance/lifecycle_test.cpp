// Nodes with a lifecycle: what rests, what waits, and that deactivation means it. Run for every
// executor under every scheduler. rclcpp #1846, #2254, #2715: there, subscriptions and timers of an
// inactive node run on.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/lifecycle_services.hpp"

namespace takt::conformance {
namespace {

class ConformanceLifecycle : public Conformance {
 protected:
  static std::shared_ptr<LifecycleNode> make_managed(Clock& clock) {
    NodeOptions options;
    options.clock = &clock;
    return std::make_shared<LifecycleNode>("managed", options);
  }
};

TEST_P(ConformanceLifecycle, AnInactiveNodeRunsNothingAndWakesNobody) {
  const auto executor = make(Clock::steady());
  const auto node = make_managed(Clock::steady());
  const auto peer = make_node(Clock::steady(), "peer");
  std::atomic<int> ran{0};
  const auto timer = node->create_timer("timer", 100us, [&] { ++ran; });
  const auto subscription =
      node->create_subscription<Number>("topic", 5, [&](const Number&) { ++ran; });
  const auto publisher = peer->create_publisher<Number>("topic", 5);
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return executor->is_spinning(); }));
  constexpr int kMessages = 200;
  for (int i = 0; i < kMessages; ++i) {
    publisher->publish(Number{i});
    std::this_thread::sleep_for(50us);
    if (i == kMessages / 2) {
      ASSERT_TRUE(node->configure());
    }
  }
  spin.stop();
  EXPECT_EQ(ran, 0);
  EXPECT_EQ(executor->pending(), 0u);
  std::uint64_t wake_ups = 0;
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    wake_ups += thread.counters.voluntary_switches;
  }
  EXPECT_LT(wake_ups, kMessages / 4u);
}

TEST_P(ConformanceLifecycle, TimersBeginTheirPhaseWithTheActiveState) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 1);
  const auto node = make_managed(clock);
  std::vector<int> starts_ms;
  const auto timer = node->create_timer("timer", 10ms, [&] {
    starts_ms.push_back(static_cast<int>(clock.now().time_since_epoch() / 1ms));
  });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, is_isolated() ? 2 : 1);
  ASSERT_TRUE(node->configure());
  clock.advance(25ms);
  timer->reset();  // what a container does when all its threads are there
  clock.advance(12ms);
  ASSERT_TRUE(node->activate());  // at 37
  clock.advance(25ms);
  ASSERT_TRUE(node->deactivate());  // at 62
  clock.advance(40ms);
  ASSERT_TRUE(node->activate());  // at 102
  clock.advance(15ms);
  EXPECT_THAT(starts_ms, ElementsAre(47, 57, 112));
  EXPECT_EQ(timer->missed(), 0u);
}

TEST_P(ConformanceLifecycle, MessagesWaitForTheActiveState) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 1);
  const auto node = make_managed(clock);
  const auto peer = make_node(clock, "peer");
  std::vector<int> seen;
  const auto subscription = node->create_subscription<Number>(
      "topic", 3, [&](const Number& number) { seen.push_back(number.value); });
  const auto publisher = peer->create_publisher<Number>("topic", 3);
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, is_isolated() ? 2 : 1);
  int next = 0;
  const auto publish = [&](int count) {
    for (int i = 0; i < count; ++i) publisher->publish(Number{next++});
    clock.settle();
  };
  ASSERT_TRUE(node->configure());
  publish(5);
  EXPECT_TRUE(seen.empty());
  ASSERT_TRUE(node->activate());
  clock.settle();
  EXPECT_THAT(seen, ElementsAre(2, 3, 4));
  publish(1);
  EXPECT_THAT(seen, ElementsAre(2, 3, 4, 5));
  ASSERT_TRUE(node->deactivate());
  publish(2);
  EXPECT_THAT(seen, ElementsAre(2, 3, 4, 5));
  ASSERT_TRUE(node->activate());
  clock.settle();
  EXPECT_THAT(seen, ElementsAre(2, 3, 4, 5, 6, 7));
}

TEST_P(ConformanceLifecycle, DeactivationWaitsForTheRunningCallback) {
  const auto executor = make(Clock::steady());
  const auto node = make_managed(Clock::steady());
  std::latch entered(1);
  std::atomic<bool> finished{false};
  const auto timer = node->create_timer("timer", 1ms, [&] {
    if (finished) return;
    entered.count_down();
    std::this_thread::sleep_for(10ms);
    finished = true;
  });
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(node->configure());
  ASSERT_TRUE(node->activate());
  entered.wait();
  EXPECT_TRUE(node->deactivate());
  EXPECT_TRUE(finished);
}

TEST_P(ConformanceLifecycle, ACallbackMayDeactivateItsOwnNode) {
  const auto executor = make(Clock::steady());
  const auto node = make_managed(Clock::steady());
  std::atomic<int> ran{0}, deactivated{0};
  const auto timer = node->create_timer("timer", 100us, [&] {
    ++ran;
    if (node->deactivate()) ++deactivated;
  });
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(node->configure());
  for (int round = 1; round <= 3; ++round) {
    ASSERT_TRUE(eventually([&] { return bool(node->activate()); }));
    ASSERT_TRUE(eventually([&] { return deactivated == round; }));
    const int before = ran;
    std::this_thread::sleep_for(1ms);
    EXPECT_EQ(ran, before);
  }
}

// A race of several workers with the gate: nothing runs in between, and nothing is lost.
TEST_P(ConformanceLifecycle, NothingRunsBetweenAndNothingIsLost) {
  const auto executor = make(Clock::steady(), 3);
  const auto node = make_managed(Clock::steady());
  const auto peer = make_node(Clock::steady(), "peer");
  const auto group = node->create_callback_group("both", CallbackGroupType::Reentrant);
  std::atomic<int> inside{0}, ran{0}, received{0};
  const auto count = [&] {
    ++inside;
    ++ran;
    --inside;
  };
  const auto timer = node->create_timer("timer", 50us, count, group);
  const auto subscription = node->create_subscription<Number>(
      "topic", 256,
      [&](const Number&) {
        count();
        ++received;
      },
      group);
  const auto publisher = peer->create_publisher<Number>("topic", 256);
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(node->configure());
  std::atomic<int> sent{0};
  std::jthread flood([&](std::stop_token stop) {
    while (!stop.stop_requested()) {
      if (sent - received < 200) {
        publisher->publish(Number{++sent});
      } else {
        std::this_thread::yield();
      }
    }
  });
  for (int round = 0; round < stress_rounds() / 200; ++round) {
    ASSERT_TRUE(node->activate());
    if (round % 10 == 0) {
      const int before = received;
      EXPECT_TRUE(eventually([&] { return received > before; }));
    }
    ASSERT_TRUE(node->deactivate());
    ASSERT_EQ(inside, 0);
    const int before = ran;
    std::this_thread::yield();
    ASSERT_EQ(ran, before);
  }
  flood.request_stop();
  flood.join();
  ASSERT_TRUE(node->activate());
  EXPECT_TRUE(eventually([&] { return received == sent; })) << received << " of " << sent;
  EXPECT_EQ(subscription->lost(), 0u);
}

TEST_P(ConformanceLifecycle, ManagedEntitiesComeAndGoWhileTheStateChanges) {
  const auto executor = make(Clock::steady());
  const auto node = make_managed(Clock::steady());
  const auto peer = make_node(Clock::steady(), "peer");
  const auto publisher = peer->create_publisher<Number>("topic", 5);
  if (!is_frozen()) executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(node->configure());
  const std::jthread control([&](std::stop_token stop) {
    while (!stop.stop_requested()) {
      EXPECT_TRUE(node->activate());
      publisher->publish(Number{1});
      EXPECT_TRUE(node->deactivate());
    }
  });
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> ran{0};
    const auto subscription =
        node->create_subscription<Number>("topic", 5, [&](const Number&) { ++ran; });
    const auto timer = node->create_timer("timer", 10us, [&] { ++ran; });
    if (round % 10 == 0 && !is_frozen()) {
      EXPECT_TRUE(eventually([&] { return ran > 0; }));
    }
  }
}

TEST_P(ConformanceLifecycle, AServiceOnTheSameExecutorChangesTheState) {
  const auto executor = make(Clock::steady());
  const auto node = make_managed(Clock::steady());
  const auto caller = make_node(Clock::steady(), "caller");
  const LifecycleServices services(*node, *node);
  const auto client =
      caller->create_client<lifecycle_msgs::srv::ChangeState>("/managed/change_state");
  std::atomic<int> ran{0};
  const auto timer = node->create_timer("timer", 100us, [&] { ++ran; });
  executor->add_node(node);
  executor->add_node(caller);
  const auto change = [&](const char* label) {
    lifecycle_msgs::srv::ChangeState::Request request;
    request.transition.label = label;
    const auto future = client->async_send_request(request);
    EXPECT_EQ(executor->spin_until_future_complete(future, 10s), FutureReturnCode::SUCCESS);
    return future.ready() && future.get()->success;
  };
  EXPECT_TRUE(change("configure"));
  EXPECT_TRUE(change("activate"));
  EXPECT_TRUE(change("deactivate"));
  EXPECT_FALSE(change("deactivate"));
  EXPECT_TRUE(change("shutdown"));
  EXPECT_EQ(node->get_current_state(), LifecycleState::finalized);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceLifecycle);

// ---- Not for every executor ----

TEST(LifecycleWaitSet, IsNotWokenByWhatRests) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  NodeOptions options;
  options.clock = &clock;
  const auto node = std::make_shared<LifecycleNode>("managed", options);
  const auto subscription = node->create_subscription<Number>("topic", 3, [](const Number&) {});
  const auto timer = node->create_timer("timer", 10ms, [] {});
  const auto publisher = node->Node::create_publisher<Number>("topic", 3);
  WaitSet set(clock);
  set.add(node->find_entity("topic"));
  set.add(node->find_entity("timer"));
  publisher->publish(Number{1});
  clock.advance(10ms);
  EXPECT_TRUE(set.wait(0ns).empty());
  ASSERT_TRUE(node->configure());
  ASSERT_TRUE(node->activate());
  EXPECT_THAT(set.wait(0ns), ElementsAre(node->find_entity("topic")));
  Number number;
  EXPECT_TRUE(subscription->take(number));
  EXPECT_EQ(number.value, 1);
  clock.advance(10ms);
  EXPECT_THAT(set.wait(0ns), ElementsAre(node->find_entity("timer")));
}

// The inputs of a period are taken before its first callback runs.
TEST(LifecycleTriggered, ACallbackThatDeactivatesTakesThePlaceOfTheOthersOfItsPeriod) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  NodeOptions options;
  options.clock = &clock;
  const auto node = std::make_shared<LifecycleNode>("managed", options);
  std::vector<std::string> trace;
  const auto first = node->create_subscription<Number>("first", 3, [&](const Number&) {
    trace.emplace_back("first");
    EXPECT_TRUE(node->deactivate());
  });
  const auto second = node->create_subscription<Number>(
      "second", 3, [&](const Number&) { trace.emplace_back("second"); });
  const auto to_first = node->Node::create_publisher<Number>("first", 3);
  const auto to_second = node->Node::create_publisher<Number>("second", 3);
  const auto executor = executors().make("triggered", {.trigger = {.let_period = 10ms},
                                                       .order = {"managed/first", "managed/second"},
                                                       .clock = &clock});
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, 1);
  ASSERT_TRUE(node->configure());
  ASSERT_TRUE(node->activate());
  to_first->publish(Number{1});
  to_second->publish(Number{1});
  clock.advance(10ms);
  EXPECT_THAT(trace, ElementsAre("first"));
  to_second->publish(Number{2});
  clock.advance(20ms);
  EXPECT_THAT(trace, ElementsAre("first"));
  ASSERT_TRUE(node->activate());
  clock.advance(20ms);
  EXPECT_THAT(trace, ElementsAre("first", "second"));
}

}  // namespace
}  // namespace takt::conformance
