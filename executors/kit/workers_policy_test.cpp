// Workers that a policy tells apart, and what has to happen exactly where workers meet.
// SPDX-License-Identifier: Apache-2.0
#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/executors/kit/kit_test.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST_F(Kit, ASnapshotThatIsForOthersIsOver) {
  const auto usual = subscribe("even", 8ms), urgent = subscribe("urgent", 0ms, 10);
  const auto more = subscribe("other");
  const auto executor = make("windows_of_two", 2);
  const ManualSpin spin(*executor, clock_, 2);
  send("even", 1);
  send("even", 2);
  send("other", 3);
  clock_.advance(1ms);
  send("urgent", 4);
  clock_.advance(1ms);
  send("urgent", 5);
  clock_.advance(1ms);
  EXPECT_THAT(trace_, ElementsAre("even1@0", "urgent4@1", "urgent5@2"));
}

TEST_F(Kit, WorkersSleepWhileTheirRuleIsClosed) {
  const auto usual = subscribe("usual", 2ms), urgent = subscribe("urgent", 2ms, 10);
  const auto executor = make("budget_of_two", 2);
  const ManualSpin spin(*executor, clock_, 2);
  for (int i = 0; i < 4; ++i) send("usual", i);
  clock_.advance(50ms);
  EXPECT_THAT(trace_, ElementsAre("usual0@0", "usual1@2", "usual2@10", "usual3@12"));
}

TEST_F(Kit, WhatIsPassedOverKeepsItsTurn) {
  std::vector<std::shared_ptr<Subscription<Number>>> groups;
  for (const char* topic : {"a", "b", "c", "d"}) groups.push_back(subscribe(topic, 1ms));
  const auto urgent = subscribe("urgent", 0ms, 10);
  const auto executor = executors().make(
      "two_bands",
      {.scheduler = "round_robin", .threads = std::vector<ThreadAttributes>(2), .clock = &clock_});
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, 2);
  for (int i = 0; i < 2; ++i) {
    for (const char* topic : {"a", "b", "c", "d"}) send(topic, i);
  }
  for (int i = 0; i < 8; ++i) {
    send("urgent", i);
    clock_.advance(1ms);
  }
  std::erase_if(trace_, [](const std::string& entry) { return entry.starts_with("urgent"); });
  EXPECT_THAT(trace_, ElementsAre("a0@0", "b0@1", "c0@2", "d0@3", "a1@4", "b1@5", "c1@6", "d1@7"));
}

TEST_F(Kit, AnyWorkerOfItsSetWakesForAFileDescriptor) {
  const int event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  std::atomic<bool> is_read{false}, may_end{false}, is_busy{false};
  const auto node = std::make_shared<Node>("real");
  const auto busy = node->create_guard_condition(
      "busy",
      [&] {
        is_busy = true;
        EXPECT_TRUE(eventually([&] { return may_end.load(); }));
      },
      node->create_callback_group("busy", CallbackGroupType::MutuallyExclusive));
  auto descriptor = node->create_file_descriptor(
      "event", event, FileDescriptorEvents::readable,
      [&](FileDescriptorEvents) {
        std::uint64_t value = 0;
        EXPECT_EQ(read(event, &value, sizeof value), ssize_t(sizeof value));
        is_read = true;
      },
      node->create_callback_group("event", CallbackGroupType::MutuallyExclusive));
  const auto executor =
      executors().make("any_of_two", {.threads = std::vector<ThreadAttributes>(2)});
  executor->add_node(node);
  {
    const SpinThread spin(*executor);
    busy->trigger();
    EXPECT_TRUE(eventually([&] { return is_busy.load(); }));
    const std::uint64_t one = 1;
    EXPECT_EQ(write(event, &one, sizeof one), ssize_t(sizeof one));
    EXPECT_TRUE(eventually([&] { return is_read.load(); }));
    may_end = true;
  }
  descriptor.reset();
  close(event);
}

TEST_F(Kit, AnUrgentCallbackFindsItsWorkerFree) {
  const auto usual = subscribe("usual", 8ms), urgent = subscribe("urgent", 1ms, 10);
  const auto executor = make("two_bands", 2);
  const ManualSpin spin(*executor, clock_, 2);
  send("usual", 1);
  send("usual", 2);
  clock_.advance(3ms);
  send("urgent", 3);
  send("urgent", 4);
  clock_.advance(100ms);
  EXPECT_THAT(trace_, ElementsAre("usual1@0", "urgent3@3", "urgent4@4", "usual2@8"));
}

TEST_F(Kit, EachWorkerWakesForItsOwnTimers) {
  const auto add = [&](const std::string& name, Nanoseconds period, Nanoseconds work,
                       int priority) {
    auto timer = node_->create_timer(
        name, period,
        [this, name, work] {
          trace_.push_back(name + "@" + std::to_string(now_ms()));
          clock_.work(work);
        },
        node_->create_callback_group(name, CallbackGroupType::MutuallyExclusive));
    timer->set_parameters({.priority = priority});
    return timer;
  };
  const auto usual = add("usual", 20ms, 15ms, 0), urgent = add("urgent", 5ms, 1ms, 10);
  const auto executor = make("two_bands", 2);
  {
    const ManualSpin spin(*executor, clock_, 2);
    clock_.advance(41ms);
    executor->release_timers(false);
  }
  std::vector<std::string> expected;
  for (int at = 5; at <= 40; at += 5) {
    if (at % 20 == 0) expected.push_back("usual@" + std::to_string(at));
    expected.push_back("urgent@" + std::to_string(at));
  }
  std::sort(expected.begin(), expected.end());
  std::sort(trace_.begin(), trace_.end());
  EXPECT_EQ(trace_, expected);
}

TEST_F(Kit, AChangedPriorityMovesACallbackToAnotherWorker) {
  const auto usual = subscribe("usual", 8ms), moved = subscribe("moved", 1ms);
  const auto executor = make("two_bands", 2);
  const ManualSpin spin(*executor, clock_, 2);
  send("usual", 1);
  send("moved", 2);
  clock_.advance(1ms);
  EXPECT_THAT(trace_, ElementsAre("usual1@0"));
  node_->set_callback_parameters({.callbacks = {{"moved", {.priority = 10}}}});
  clock_.advance(1ms);
  EXPECT_THAT(trace_, ElementsAre("usual1@0", "moved2@1"));
}

TEST_F(Kit, TheOnlyThreadThatSpinsTakesAll) {
  const auto usual = subscribe("usual"), urgent = subscribe("urgent", 0ns, 10);
  const auto executor = make("two_bands", 2);
  send("usual", 1);
  send("urgent", 2);
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("usual1@0", "urgent2@0"));
}

TEST_F(Kit, TheNextParkedCallbackFollowsOneThatIsRemoved) {
  const auto group = node_->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  const auto in_group = [&](const std::string& topic, Nanoseconds work) {
    return node_->create_subscription<Number>(
        topic, 9,
        [this, topic, work](const Number&) {
          trace_.push_back(topic + "@" + std::to_string(now_ms()));
          clock_.work(work);
        },
        group);
  };
  const auto first = in_group("first", 10ms);
  auto removed = in_group("removed", 0ms);
  const auto next = in_group("next", 0ms);
  const auto urgent = subscribe("urgent", 10ms, 5);
  const auto remover = node_->create_subscription<Number>(
      "remover", 9,
      [&](const Number&) {
        clock_.work(10ms);
        removed.reset();
      },
      node_->create_callback_group("remover", CallbackGroupType::MutuallyExclusive));
  const auto executor = executors().make("events", {.scheduler = "fixed_priority",
                                                    .threads = std::vector<ThreadAttributes>(2),
                                                    .clock = &clock_});
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, 2);
  send("first", 1);  // the first worker, until 10
  clock_.advance(1ms);
  send("removed", 2);  // parked, as their group is busy
  send("next", 3);
  clock_.advance(1ms);
  send("remover", 4);  // the second worker, until 12
  clock_.advance(1ms);
  send("urgent", 5);  // the first worker after `first`, until 20: `removed` waits in the order
  clock_.advance(30ms);
  EXPECT_THAT(trace_, ElementsAre("first@0", "urgent5@10", "next@12"));
}

TEST_F(Kit, TheWatchdogAbortsAChainAtTheDeadline) {
  const auto to_last = node_->create_publisher<Number>("last", 9);
  const auto late = node_->create_subscription<Number>(
      "late", 9,
      [&](const Number&) {
        to_last->publish(Number{1});
        clock_.work(7ms);
        to_last->publish(Number{2});
        clock_.work(7ms);
      },
      node_->create_callback_group("late", CallbackGroupType::MutuallyExclusive));
  late->set_parameters({.deadline = 5ms, .overrun = OverrunPolicy::abort});
  const auto last = subscribe("last");
  const auto chain = Chain::create({.name = "chain"}, {{node_, "late"}, {node_, "last"}});
  const auto executor =
      executors().make("events", {.threads = std::vector<ThreadAttributes>(2),
                                  .watchdog = std::make_shared<Watchdog>(
                                      ThreadAttributes{.name = "watchdog"}, Realtime::off, clock_),
                                  .clock = &clock_});
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, 3);
  send("late", 0);
  clock_.advance(30ms);
  EXPECT_THAT(trace_, ElementsAre("last1@0"));
}

TEST_F(Kit, AGroupsDeadlineIsThatOfItsReservation) {
  const auto group = node_->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  group->set_parameters({.deadline = 2ms, .period = 10ms, .budget = 1ms});
  const auto timer = node_->create_timer(
      "timer", 10ms, [] {}, group);
  ThreadAttributes reserved{.policy = ThreadPolicy::deadline};
  reserved.runtime = 3ms;
  reserved.period = 30ms;
  const auto executor = executors().make(
      "isolated", {.threads = {reserved}, .per = Isolation::group, .realtime = Realtime::off});
  executor->add_node(node_);
  {
    const SpinThread spin(*executor);
    EXPECT_TRUE(eventually([&] { return executor->is_spinning(); }));
  }
  const auto threads = executor->thread_statistics();
  const auto found = std::find_if(threads.begin(), threads.end(), [](const auto& thread) {
    return thread.asked.policy == ThreadPolicy::deadline && thread.asked.runtime == 1ms;
  });
  ASSERT_NE(found, threads.end());
  EXPECT_EQ(found->asked.deadline, 2ms);
  EXPECT_EQ(found->asked.period, 10ms);
}

TEST_F(Kit, RefusesACallbackWithoutAWorkerAndThreadsThatSpinForOthers) {
  const auto executor = make("two_bands", 2);
  EXPECT_THAT([&] { subscribe("nowhere"); },
              ThrowsMessage<Error>(HasSubstr("no thread may take callback 'nowhere' of '/node'")));
  EXPECT_THAT([] { executors().make("two_bands", {.spin = 10us}); },
              ThrowsMessage<Error>(HasSubstr("leave out `spin` and `early_wake`")));
}

}  // namespace
}  // namespace takt::conformance
