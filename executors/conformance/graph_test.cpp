// Nodes, groups and entities that come and go. Run for every executor under
// every scheduler. The numbers in the comments are those of the rclcpp issues (or the project)
// whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <utility>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceGraph : public Conformance {};

// #2067: what came after spin was seen at the next wake-up, if ever.
TEST_P(ConformanceGraph, WhatIsAddedWhileSpinningRuns) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> ran{0};
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return executor->is_spinning(); }));
  if (is_frozen()) {
    ASSERT_TRUE(eventually([&] {
      try {
        executor->add_node(make_node(Clock::steady(), "late"));
        return false;
      } catch (const Error&) {
        return true;
      }
    }));
    EXPECT_THROW(auto guard = node->create_guard_condition("late", [] {}), Error);
    return;
  }
  const auto group = node->create_callback_group("late", CallbackGroupType::MutuallyExclusive);
  const auto guard = node->create_guard_condition(
      "guard", [&] { ++ran; }, group);
  guard->trigger();
  EXPECT_TRUE(eventually([&] { return ran == 1; }));
  const auto other = make_node(Clock::steady(), "other");
  const auto subscription =
      other->create_subscription<Number>("late", 5, [&](const Number&) { ++ran; });
  const auto publisher = node->create_publisher<Number>("late", 5);
  publisher->publish(Number{});  // before it is added: it waits
  executor->add_node(other);
  EXPECT_TRUE(eventually([&] { return ran == 2; }));
  const auto timer = node->create_timer("timer", 1ms, [&] { ++ran; });
  EXPECT_TRUE(eventually([&] { return ran >= 4; }));
}

// A lifecycle node that makes its callbacks when it is configured, and drops them when it is
// cleaned up, had no rows in the results, and neither had the thread that ran them.
TEST_P(ConformanceGraph, RemovedCallbacksKeepTheirRowsAndAddUp) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto executor = make(Clock::steady());
  const auto peer = make_node(Clock::steady(), "peer");
  const auto publisher = peer->create_publisher<Number>("topic", 5);
  std::atomic<int> ran{0};
  {
    SpinThread spin(*executor);
    for (int round = 1; round <= 2; ++round) {
      const auto node = make_node(Clock::steady(), "managed");
      auto subscription =
          node->create_subscription<Number>("topic", 5, [&](const Number&) { ++ran; });
      executor->add_node(node);
      for (int i = 0; i < 3; ++i) publisher->publish(Number{i});
      ASSERT_TRUE(eventually([&] { return ran == 3 * round && executor->pending() == 0; }));
      subscription.reset();
      executor->remove_node(node);
    }
  }
  const auto rows = executor->statistics();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].node, "/managed");
  EXPECT_EQ(rows[0].topic, "/topic");
  EXPECT_EQ(rows[0].received, 6u);
  EXPECT_EQ(rows[0].expected, 6u);
  EXPECT_EQ(rows[0].execution.count(), 6u);
  EXPECT_FALSE(executor->thread_statistics().empty());
}

TEST_P(ConformanceGraph, ANodeCanBeAddedFromACallback) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto second = make_node(Clock::steady(), "second");
  const auto timer = second->create_timer("timer", 1ms, [&] { executor->cancel(); });
  const auto guard = node->create_guard_condition("guard", [&] { executor->add_node(second); });
  executor->add_node(node);
  guard->trigger();
  executor->spin();
}

// A removed callback that was announced between its removal and its last announcement ran again.
TEST_P(ConformanceGraph, NothingRunsAfterARemovalThoughCallbacksPublishToItMeanwhile) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto leaving = make_node(Clock::steady(), "leaving");
  const auto publisher = node->create_publisher<Number>("topic", 5);
  std::atomic<bool> may_run{true};
  std::atomic<int> ran_after{0}, rounds{0};
  const auto subscription = leaving->create_subscription<Number>("topic", 5, [&](const Number&) {
    if (!may_run) ++ran_after;
  });
  const auto guard = leaving->create_guard_condition("guard", [&] {
    if (!may_run) ++ran_after;
  });
  std::shared_ptr<GuardCondition> busy;
  busy = node->create_guard_condition("busy", [&] {
    publisher->publish(Number{1});
    guard->trigger();
    ++rounds;
    busy->trigger();
  });
  executor->add_node(node);
  SpinThread spin(*executor);
  busy->trigger();
  for (int round = 0; round < 15; ++round) {
    may_run = true;
    executor->add_node(leaving);
    int before = rounds;
    ASSERT_TRUE(eventually([&] { return rounds > before; }));
    executor->remove_node(leaving);
    may_run = false;
    before = rounds;
    ASSERT_TRUE(eventually([&] { return rounds > before + 1; }));
  }
  EXPECT_EQ(ran_after, 0);
}

// `isolated` gave a thread to a child that had gone meanwhile, and so ended the process.
TEST_P(ConformanceGraph, NodesAreRemovedWhileASpinBegins) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto executor = make(Clock::steady());
  std::atomic<bool> has_begun{false};
  const auto first = make_node(Clock::steady(), "first");
  const auto guard = first->create_guard_condition("guard", [&] {
    has_begun = true;
    has_begun.notify_all();
  });
  guard->trigger();
  executor->add_node(first);
  std::vector<std::shared_ptr<Node>> nodes;
  std::vector<std::shared_ptr<GuardCondition>> guards;
  for (int i = 0; i < 30; ++i) {
    nodes.push_back(make_node(Clock::steady(), "node_" + std::to_string(i)));
    guards.push_back(nodes.back()->create_guard_condition("guard", [] {}));
    executor->add_node(nodes.back());
  }
  SpinThread spin(*executor);
  has_begun.wait(false);
  for (; !nodes.empty(); nodes.pop_back()) executor->remove_node(nodes.back());
}

// A node called its listeners without their being there any more.
TEST_P(ConformanceGraph, EntitiesAreMadeWhileExecutorsComeAndGo) {
  const auto node = make_node(Clock::steady());
  const std::jthread maker([&](const std::stop_token& stop) {
    for (int i = 0; !stop.stop_requested(); ++i) {
      const auto timer = node->create_timer("timer_" + std::to_string(i), 1s, [] {});
      const auto group =
          node->create_callback_group("late_" + std::to_string(i), CallbackGroupType::Reentrant);
      const auto guard = node->create_guard_condition(
          "guard", [] {}, group);
    }
  });
  for (int round = 0; round < 50; ++round) {
    const auto executor = make(Clock::steady());
    executor->add_node(node);
    if (!is_frozen()) executor->spin_some();
  }
}

// What the user has dropped, and the executor still kept, was found in its node and added again.
TEST_P(ConformanceGraph, WhatWasDroppedIsNotAddedAgain) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto group = node->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  int ran = 0;
  auto guard = node->create_guard_condition(
      "guard", [&] { ++ran; }, group);
  const auto helper = node->create_guard_condition("helper", [&] {
    executor->remove_callback_group(group, node);
    guard->trigger();
    guard.reset();
    executor->add_callback_group(group, node);
  });
  executor->add_node(node);
  helper->trigger();
  executor->spin_some();
  executor->spin_some();
  EXPECT_EQ(ran, 0);
}

// The callback of one executor spins another, whose callback removes the first.
TEST_P(ConformanceGraph, ACallbackIsRemovedFromWithinASpinThatItHasBegun) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto outer = make(Clock::steady());
  const auto inner = make(Clock::steady());
  const auto node = make_node(Clock::steady(), "outer");
  const auto other = make_node(Clock::steady(), "inner");
  int ran = 0;
  const auto remover = other->create_guard_condition("remover", [&] { outer->remove_node(node); });
  const auto guard = node->create_guard_condition("guard", [&] {
    ++ran;
    remover->trigger();
    inner->spin_some();
  });
  outer->add_node(node);
  inner->add_node(other);
  guard->trigger();
  outer->spin_some();
  guard->trigger();
  outer->spin_some();
  EXPECT_EQ(ran, 1);
}

// #2664, #2403, #272: use after free when entities went while the executor spun.
TEST_P(ConformanceGraph, EntitiesComeAndGoWhileMessagesArrive) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto source = make_node(Clock::steady(), "source");
  const auto publisher = source->create_publisher<Number>("topic", 5);
  std::atomic<bool> stop{false};
  std::atomic<int> received{0};
  if (!is_frozen()) executor->add_node(node);
  SpinThread spin(*executor);
  std::thread flood([&] {
    while (!stop) publisher->publish(Number{1});
  });
  for (int round = 0; round < 50; ++round) {
    auto data = std::make_unique<int>(0);
    auto subscription = node->create_subscription<Number>("topic", 5, [&](const Number& number) {
      *data += number.value;  // a use after free if it runs after the handle went
      ++received;
    });
    const auto timer = node->create_timer("timer", 100us, [&] { *data += 1; });
    // Most go at once, some in the middle of the flood.
    const int before = received;
    if (round % 10 == 0 && !is_frozen()) {
      ASSERT_TRUE(eventually([&] { return received > before; }));
    }
  }
  stop = true;
  flood.join();
}

TEST_P(ConformanceGraph, RemovingWaitsForTheRunningCallback) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is removed after the first spin";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::latch entered(1);
  std::atomic<bool> finished{false};
  const auto guard = node->create_guard_condition("guard", [&] {
    entered.count_down();
    std::this_thread::sleep_for(20ms);
    finished = true;
  });
  executor->add_node(node);
  SpinThread spin(*executor);
  guard->trigger();
  entered.wait();
  executor->remove_node(node);
  EXPECT_TRUE(finished);
  EXPECT_THROW(executor->remove_node(node), Error);  // #3186: twice is defined
  guard->trigger();                                  // reaches nobody
  executor->add_node(node);
  EXPECT_TRUE(eventually([&] { return guard->ready_count() == 0; }));  // it waited, and runs
}

TEST_P(ConformanceGraph, ACallbackMayDropItsOwnEntity) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> ran{0};
  std::shared_ptr<Timer> timer;
  timer = node->create_timer("timer", 1ms, [&] {
    timer.reset();
    ++ran;
  });
  const auto guard = node->create_guard_condition("guard", [&] { ++ran; });
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return ran == 1; }));
  guard->trigger();
  EXPECT_TRUE(eventually([&] { return ran == 2; }));
}

TEST_P(ConformanceGraph, ANodeOrGroupBelongsToOneExecutor) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto first = make(Clock::steady());
  const auto second = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto apart =
      node->create_callback_group("apart", CallbackGroupType::MutuallyExclusive, false);
  int ran = 0;
  const auto guard = node->create_guard_condition(
      "guard", [&] { ++ran; }, apart);
  first->add_node(node);
  EXPECT_THROW(second->add_node(node), Error);
  guard->trigger();
  first->spin_some();
  EXPECT_EQ(ran, 0) << "the group was not to be added with its node";
  second->add_callback_group(apart, node);
  EXPECT_THROW(first->add_callback_group(apart, node), Error);
  second->spin_some();
  EXPECT_EQ(ran, 1);
  second->remove_callback_group(apart, node);
  first->add_callback_group(apart, node);
  guard->trigger();
  first->spin_some();
  EXPECT_EQ(ran, 2);
}

// The group kept callbacks of an executor that had been cancelled while they were parked, and then
// destroyed; the next executor ran into their freed records.
TEST_P(ConformanceGraph, ParkedCallbacksFollowTheirNodeToTheNextExecutor) {
  const auto node = make_node(Clock::steady());
  std::latch entered(1), leave(1);
  int ran = 0;
  const auto blocker = node->create_guard_condition("blocker", [&] {
    entered.count_down();
    leave.wait();
  });
  const auto a = node->create_guard_condition("a", [&] { ++ran; });
  const auto b = node->create_guard_condition("b", [&] { ++ran; });
  {
    const auto first = make(Clock::steady());
    first->add_node(node);
    SpinThread spin(*first);
    blocker->trigger();
    entered.wait();
    a->trigger();
    b->trigger();
    first->cancel();
    leave.count_down();
    spin.join();
  }
  ran = 0;
  a->trigger();
  b->trigger();
  const auto second = make(Clock::steady());
  second->add_node(node);
  second->spin_all();
  EXPECT_EQ(ran, 2);
}

TEST_P(ConformanceGraph, AnExecutorMayGoBeforeItsNodesAndAfterThem) {
  ManualClock clock{TimePoint{}, virtual_cpus()};  // so the short-lived timer is never due
  const auto node = make_node(clock);
  int ran = 0;
  auto guard = node->create_guard_condition("guard", [&] { ++ran; });
  {
    const auto executor = make(clock);
    executor->add_node(node);
    guard->trigger();
    executor->spin_some();
  }
  EXPECT_EQ(ran, 1);
  guard->trigger();  // nobody listens
  guard.reset();
  const auto executor = make(clock);
  {
    const auto short_lived = make_node(clock, "short_lived");
    const auto timer = short_lived->create_timer("timer", 1ms, [&] { ++ran; });
    executor->add_node(short_lived);
    executor->spin_some();
  }
  executor->spin_some();
  const auto rows = executor->statistics();  // of what has gone, too
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].received, 0u);
  EXPECT_EQ(ran, 1);
}

// #3222 and the blocking constructor of component containers: a node that is made slowly, on
// another thread, does not hold up those that run.
TEST_P(ConformanceGraph, NodesThatAreBuiltElsewhereHoldUpNobody) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto executor = make(Clock::steady());
  const auto running = make_node(Clock::steady(), "running");
  std::atomic<int> ticks{0};
  const auto timer = running->create_timer("timer", 500us, [&] { ++ticks; });
  executor->add_node(running);
  SpinThread spin(*executor);
  std::vector<std::shared_ptr<void>> parts;
  for (int i = 0; i < 20; ++i) {
    const auto node = make_node(Clock::steady(), "loaded_" + std::to_string(i));
    const int before = ticks;
    ASSERT_TRUE(eventually([&] { return ticks > before; }));  // "constructing"
    parts.push_back(node->create_timer("timer", 1ms, [] {}));
    parts.push_back(node);
    executor->add_node(node);
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceGraph);

class KnowsItsCallbacks : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    for (const CallbackInfo& callback : callbacks) ids_.insert(callback.id);
  }
  void push(ReadyCallback& callback) noexcept override {
    callback.next = std::exchange(first_, &callback);
  }
  ReadyCallback* pop() noexcept override {
    return first_ == nullptr ? nullptr : std::exchange(first_, first_->next);
  }
  void done(const ReadyCallback& callback, Nanoseconds) noexcept override {
    trace.emplace_back(ids_.contains(callback.info->id) ? "known" : "unknown");
  }
  static inline std::vector<std::string> trace;

 private:
  std::set<CallbackId> ids_;
  ReadyCallback* first_ = nullptr;
};

// A scheduler that was installed since has no room for what was removed: none must hear of it.
TEST(Schedulers, DoNotGetTheEndOfACallbackThatIsRemovedMeanwhile) {
  schedulers().add("knowing", {"", make_scheduler<KnowsItsCallbacks>});
  const auto executor = executors().make("events", {.scheduler = "knowing"});
  const auto node = std::make_shared<Node>("node");
  const auto stays = node->create_guard_condition("stays", [] {});
  std::shared_ptr<GuardCondition> leaves;
  leaves = node->create_guard_condition("leaves", [&] { leaves.reset(); });
  executor->add_node(node);
  leaves->trigger();
  executor->spin_some();
  stays->trigger();
  executor->spin_some();
  EXPECT_THAT(KnowsItsCallbacks::trace, ElementsAre("known"));
}

// The handler of a spin that was refused was called in the next one.
TEST(Executor, ForgetsTheHandlerOfASpinThatWasRefused) {
  ExecutorOptions options;
  options.threads = {
      {.name = "all", .policy = ThreadPolicy::deadline, .runtime = 10ms, .period = 10ms}};
  options.realtime = Realtime::require;
  const auto executor = executors().make("events", options);
  const auto node = std::make_shared<Node>("node");
  const auto ends = node->create_guard_condition("ends", [&] { executor->cancel(); });
  const auto guard = node->create_guard_condition("guard", [] { throw 1; });
  executor->add_node(node);
  ends->trigger();
  bool is_refused = false, is_called = false;
  std::thread([&] {
    try {
      executor->spin([&](const FailedCallback&) { return is_called = true; });
    } catch (const Error&) {
      is_refused = true;
    }
  }).join();
  if (!is_refused) GTEST_SKIP() << "this kernel gives a thread all of a CPU";
  executor->spin_some();
  guard->trigger();
  EXPECT_THROW(executor->spin_some(), int);
  EXPECT_FALSE(is_called);
}

// Keys of waiting callbacks were those of before.
TEST(Executor, OrdersWhatWaitsByTheParametersThatHoldNow) {
  for (const char* type : {"events", "single_threaded"}) {
    const auto executor = executors().make(type, {.scheduler = "edf"});
    const auto node = std::make_shared<Node>("node");
    std::vector<std::string> order;
    std::vector<std::shared_ptr<GuardCondition>> guards;
    for (const auto& [name, deadline] :
         {std::pair("first", 1s), std::pair("second", 10s), std::pair("third", 20s)}) {
      guards.push_back(
          node->create_guard_condition(name, [&order, n = name] { order.emplace_back(n); }));
      guards.back()->set_parameters({.deadline = deadline});
    }
    executor->add_node(node);
    for (const auto& guard : guards) guard->trigger();
    executor->spin_once();  // the others wait in the scheduler
    node->set_callback_parameters({.callbacks = {{"third", {.deadline = 2s}}}});
    executor->spin_all();
    EXPECT_THAT(order, ElementsAre("first", "third", "second")) << type;
  }
}

}  // namespace
}  // namespace takt::conformance
