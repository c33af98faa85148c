// Exclusion, parallelism, and bounded queues. Run for every executor under
// every scheduler. The numbers in the comments are those of the rclcpp issues (or the project)
// whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include <random>

#include <sys/resource.h>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

std::int64_t voluntary_switches_of_process() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_nvcsw;
}

class ConformanceGroups : public Conformance {};

// ---- Groups ----

TEST_P(ConformanceGroups, CallbacksOfAnExclusiveGroupNeverRunAtTheSameTime) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> inside{0}, most{0}, ran{0};
  const auto body = [&] {
    const int now = ++inside;
    int seen = most;
    while (now > seen && !most.compare_exchange_weak(seen, now)) {
    }
    std::this_thread::yield();
    --inside;
    ++ran;
  };
  std::vector<std::shared_ptr<GuardCondition>> guards;
  for (int i = 0; i < 4; ++i) {
    guards.push_back(node->create_guard_condition("guard_" + std::to_string(i), body));
  }
  executor->add_node(node);
  SpinThread spin(*executor);
  for (int round = 0; round < 2000; ++round) {
    for (const auto& guard : guards) guard->trigger();
  }
  EXPECT_TRUE(eventually([&] { return executor->pending() == 0; }));
  EXPECT_GE(ran, 4);  // triggers that wait are one
  EXPECT_LE(ran, 4 * 2000);
  EXPECT_EQ(most, 1);
}

// #3175: reentrant groups ran one callback at a time.
TEST_P(ConformanceGroups, AReentrantGroupRunsInParallelWhereThereAreThreads) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  const auto group = node->create_callback_group("parallel", CallbackGroupType::Reentrant);
  std::vector<std::string> trace;
  const auto subscription = node->create_subscription<Number>(
      "topic", 5,
      [&](const Number& number) {
        trace.push_back("start " + std::to_string(number.value));
        clock.work(1ms);
        trace.push_back("end " + std::to_string(number.value));
      },
      group);
  const auto publisher = node->create_publisher<Number>("topic", 5);
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants(CallbackGroupType::Reentrant));
  clock.settle();
  publisher->publish(Number{1});
  publisher->publish(Number{2});
  clock.advance(10ms);
  if (reentrant_workers() > 1) {  // both messages of the one subscription at the same time
    EXPECT_THAT(trace, ElementsAre("start 1", "start 2", "end 1", "end 2"));
  } else {
    EXPECT_THAT(trace, ElementsAre("start 1", "end 1", "start 2", "end 2"));
  }
}

// #2012, #832: what a busy group kept from running was lost; level-triggered wait sets spin on it.
TEST_P(ConformanceGroups, ABusyExclusiveGroupLosesNothingAndWakesNobody) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::latch entered(1), leave(1);
  std::atomic<int> received{0};
  const auto blocker = node->create_guard_condition("blocker", [&] {
    entered.count_down();
    leave.wait();
  });
  std::vector<std::shared_ptr<void>> parts;
  for (int i = 0; i < 3; ++i) {
    parts.push_back(
        node->create_subscription<Number>("topic", 10, [&](const Number&) { ++received; }));
  }
  const auto publisher = node->create_publisher<Number>("topic", 10);
  executor->add_node(node);
  SpinThread spin(*executor);
  blocker->trigger();
  entered.wait();
  const std::int64_t switches = voluntary_switches_of_process();
  for (int i = 0; i < 10; ++i) publisher->publish(Number{i});
  std::this_thread::sleep_for(50ms);  // time in which a busy loop would show
  EXPECT_LT(voluntary_switches_of_process() - switches, 10);
  leave.count_down();
  EXPECT_TRUE(eventually([&] { return received == 30; })) << received;
  spin.stop();
}

// An executor forgets callbacks that were removed at rest late: it took the place where the next
// executor's callbacks of the group waited.
TEST_P(ConformanceGroups, WhatAnEarlierExecutorKeptOfAGroupIsNoneOfTheNextOnes) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto order_after = [this](const std::string& scheduler_before) {
    ManualClock clock{TimePoint{}, virtual_cpus()};
    const auto node = make_node(clock);
    const auto larger = make_node(clock, "larger");
    std::vector<std::shared_ptr<GuardCondition>> others;
    for (int i = 0; i < 5; ++i) {
      others.push_back(larger->create_guard_condition("other_" + std::to_string(i), [] {}));
    }
    std::unique_ptr<Executor> before;
    std::vector<std::string> trace;
    const auto low = node->create_guard_condition("low", [&] { trace.push_back("low"); });
    const auto high = node->create_guard_condition("high", [&] { trace.push_back("high"); });
    node->set_callback_parameters({.callbacks = {{"high", {.priority = 2, .deadline = 1ms}}}});
    const auto first = node->create_guard_condition("first", [&] {
      low->trigger();
      high->trigger();
      clock.work(1ms);  // another worker parks both
      before.reset();
      trace.push_back("first");
    });
    if (!scheduler_before.empty()) {
      before = make({.scheduler = scheduler_before, .clock = &clock});
      before->add_node(node);
      before->add_node(larger);  // so few callbacks less are not worth a new scheduler
      before->spin_some();
      before->remove_node(node);
    }
    const auto executor = make(clock);
    executor->add_node(node);
    const ManualSpin spin(*executor, clock, participants());
    clock.settle();
    first->trigger();
    clock.advance(10ms);
    return trace;
  };
  const std::vector<std::string> undisturbed = order_after("");
  ASSERT_EQ(undisturbed.size(), 3u);
  EXPECT_EQ(order_after("fifo"), undisturbed);
  EXPECT_EQ(order_after("fixed_priority"), undisturbed);
}

// ---- Queues ----

// #2771, #3213: queues of events grew without bound while their messages were overwritten.
TEST_P(ConformanceGroups, OverwrittenMessagesLeaveNoTrace) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<int> values;
  const auto subscription = node->create_subscription<Number>(
      "topic", 3, [&](const Number& number) { values.push_back(number.value); });
  const auto publisher = node->create_publisher<Number>("topic", 3, {.loans = 8});
  executor->add_node(node);
  executor->spin_some();
  for (int i = 0; i < 1000; ++i) {
    auto loan = publisher->borrow_loaned_message();
    ASSERT_TRUE(loan) << "overwritten messages must come home at once";
    loan->value = i;
    publisher->publish(std::move(loan));
  }
  executor->spin_all();
  EXPECT_THAT(values, ElementsAre(997, 998, 999));
  for (const CallbackStatistics& callback : executor->statistics()) {
    EXPECT_EQ(callback.received, 3u);
    EXPECT_EQ(callback.dropped, 997u);
    EXPECT_EQ(callback.expected, 1000u);
  }
}

// #3240: a group dropped out of the wait set when a time-out and a trigger coincided. Every message
// of every round must arrive, whatever the timing.
TEST_P(ConformanceGroups, NoWakeUpIsEverLost) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto group = node->create_callback_group("parallel", CallbackGroupType::Reentrant);
  std::atomic<int> received{0};
  const auto count = [&](const Number&) { received.fetch_add(1); };
  const auto a = node->create_subscription<Number>("topic", 10, count);
  const auto b = node->create_subscription<Number>("topic", 10, count);
  const auto c = node->create_subscription<Number>("topic", 10, count, group);
  const auto timer = node->create_timer("timer", 53us, [] {});
  const auto publisher = node->create_publisher<Number>("topic", 10, {.loans = 64});
  executor->add_node(node);
  SpinThread spin(*executor);
  std::minstd_rand random(42);
  int sent = 0;
  // Shared by all executor × scheduler pairs, so that the suite stays short.
  const int rounds = std::max(1, stress_rounds() / 30);
  for (int round = 0; round < rounds; ++round) {
    const auto burst = 1 + random() % 3;
    for (unsigned long i = 0; i < burst; ++i) {
      publisher->publish(publisher->borrow_loaned_message());
      sent += 3;
    }
    // Now and then the executor falls asleep before the next round, now and then it does not.
    if (random() % 4 == 0) {
      const auto until =
          std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 80);
      while (std::chrono::steady_clock::now() < until) {
      }
    }
    ASSERT_TRUE(eventually([&] { return received == sent; })) << "round " << round;
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceGroups);

}  // namespace
}  // namespace takt::conformance
