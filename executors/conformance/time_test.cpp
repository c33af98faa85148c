// Timers, threads, allocations, and the envelope of a chain. Run for every executor under
// every scheduler. The numbers in the comments are those of the rclcpp issues (or the project)
// whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceTime : public Conformance {};

// ---- Timers ----

// #2771: after an overrun the missed releases came in a burst.
TEST_P(ConformanceTime, AnOverrunningTimerKeepsItsPhaseAndOneRelease) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<int> starts_ms;
  const auto timer = node->create_timer("timer", 10ms, [&] {
    starts_ms.push_back(static_cast<int>(clock.now().time_since_epoch() / 1ms));
    clock.work(starts_ms.size() == 2 ? 35ms : 1ms);
  });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(85ms);
  // Released at 30, 40 and 50 while the second runs: 30 is outstanding, 40 and 50 are missed.
  EXPECT_THAT(starts_ms, ElementsAre(10, 20, 55, 60, 70, 80));
  EXPECT_EQ(timer->missed(), 2u);
}

TEST_P(ConformanceTime, EachReleaseThatMayWaitIsServedAndTheOthersAreMissed) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<int> starts_ms;
  const auto timer = node->create_timer("timer", 10ms, [&] {
    starts_ms.push_back(static_cast<int>(clock.now().time_since_epoch() / 1ms));
    clock.work(starts_ms.size() == 2 ? 55ms : 1ms);
  });
  timer->set_parameters({.releases = 3});
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(85ms);
  // Released at 30 to 70 while the second runs: 40 and 50 are missed.
  EXPECT_THAT(starts_ms, ElementsAre(10, 20, 75, 76, 77, 80));
  EXPECT_EQ(timer->missed(), 2u);
}

// #2375, #2803, #2889: timers lost, stopped or shifted by cancel and reset.
TEST_P(ConformanceTime, CancelAndResetOfTimersMeanWhatTheySay) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 1);
  const auto node = make_node(clock);
  std::vector<std::string> trace;
  const auto note = [&](const std::string& name) {
    trace.push_back(name + " " + std::to_string(clock.now().time_since_epoch() / 1ms));
  };
  std::shared_ptr<Timer> once;
  const auto steady = node->create_timer("steady", 10ms, [&] { note("steady"); });
  once = node->create_timer("once", 4ms, [&] {
    note("once");
    once->cancel();
  });
  std::shared_ptr<Timer> self_reset = node->create_timer("self_reset", 15ms, [&] {
    note("self_reset");
    clock.work(2ms);
    self_reset->reset();
  });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, is_isolated() ? 2 : 1);
  clock.advance(12ms);
  EXPECT_TRUE(once->is_canceled());
  once->reset();  // from 12: again at 16
  clock.advance(10ms);
  steady->cancel();
  clock.advance(10ms);
  steady->reset();  // from 32: at 42
  clock.advance(12ms);
  EXPECT_THAT(trace, ElementsAre("once 4", "steady 10", "self_reset 15", "once 17", "steady 20",
                                 "self_reset 32", "steady 42"));
}

// What is held runs neither by itself nor beside a callback that keeps its thread awake.
TEST_P(ConformanceTime, HeldTimersDoNotRunBesideOthers) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int timers = 0, others = 0;
  const auto timer = node->create_timer("timer", 10ms, [&] { ++timers; });
  std::shared_ptr<GuardCondition> guard;
  guard = node->create_guard_condition("guard", [&] {
    if (++others < 3) guard->trigger();
  });
  executor->add_node(node);
  executor->release_timers(false);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(25ms);
  guard->trigger();
  clock.advance(1ms);
  EXPECT_EQ(others, 3);
  EXPECT_EQ(timers, 0);
  executor->release_timers(true);
  clock.advance(10ms);
  EXPECT_GE(timers, 1);
}

// #2535 in part: time that jumps. One clock per node is all that there is so far.
TEST_P(ConformanceTime, AJumpOfTimeGivesOneReleaseAndCountsTheRest) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int ran = 0;
  const auto timer = node->create_timer("timer", 10ms, [&] { ++ran; });
  executor->add_node(node);
  executor->spin_some();
  clock.work(95ms);  // the clock jumps past nine releases
  executor->spin_all();
  EXPECT_EQ(ran, 1);
  EXPECT_EQ(timer->missed(), 8u);
  EXPECT_EQ(*timer->next_release(), TimePoint(100ms));
}

// ---- Real time ----

// #5, #463, rclc 114: nothing allocates once it spins.
TEST_P(ConformanceTime, DispatchAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto group = node->create_callback_group("parallel", CallbackGroupType::Reentrant);
  std::atomic<int> received{0};
  const auto publisher = node->create_publisher<Number>("topic", 5, {.loans = 64});
  const auto timer = node->create_timer("timer", 200us, [&] {
    for (int i = 0; i < 3; ++i) publisher->publish(publisher->borrow_loaned_message());
  });
  const auto look =
      node->create_subscription<Number>("topic", 5, [&](const Number&) { ++received; });
  const auto share = node->create_subscription<Number>(
      "topic", 5, [&](std::shared_ptr<const Number>) { ++received; }, group);
  const auto guard = node->create_guard_condition("guard", [&] { ++received; });
  executor->add_node(node);
  SpinThread spin(*executor);
  EXPECT_TRUE(eventually([&] {
    guard->trigger();
    return received > 300;
  }));
  spin.stop();
  const auto threads = executor->thread_statistics();
  ASSERT_FALSE(threads.empty());
  for (const ThreadStatistics& thread : threads) {
    EXPECT_EQ(thread.counters.allocations, 0u) << thread.asked.name;
  }
}

// What CIE does late, from another process: attributes hold before the first callback.
TEST_P(ConformanceTime, ThreadsHaveTheirAttributesBeforeTheFirstCallback) {
  ExecutorOptions options;
  options.scheduler = scheduler_name();
  const int cpu = available_cpus().back();
  ThreadAttributes attributes{.name = "conform", .policy = ThreadPolicy::batch, .affinity = {cpu}};
  options.threads.assign(workers(), attributes);
  options.realtime = Realtime::require;
  const auto executor = make(options);
  const auto node = make_node(Clock::steady());
  ThreadState seen;
  const auto timer = node->create_timer("timer", 100us, [&] {
    seen = this_thread_state();
    executor->cancel();
  });
  executor->add_node(node);
  std::thread([&] { executor->spin(); }).join();
  EXPECT_EQ(seen.policy, ThreadPolicy::batch);
  EXPECT_THAT(seen.affinity, ElementsAre(cpu));
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    EXPECT_EQ(thread.in_force.policy, ThreadPolicy::batch);
  }
}

// ---- What later issues build on ----

// The envelope carries a chain: three nodes, one instance, the release of its root.
TEST_P(ConformanceTime, AChainKeepsItsInstanceAndTheReleaseOfItsRoot) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 1);
  std::vector<std::pair<std::uint64_t, TimePoint>> steps;
  const auto note = [&] {
    const Dispatch* dispatch = Dispatch::current();
    ASSERT_NE(dispatch, nullptr);
    steps.emplace_back(dispatch->chain_instance, dispatch->root_release);
    clock.work(1ms);
  };
  const auto sensor = make_node(clock, "sensor");
  const auto filter = make_node(clock, "filter");
  const auto actor = make_node(clock, "actor");
  const auto raw = sensor->create_publisher<Number>("raw", 5);
  const auto filtered = filter->create_publisher<Number>("filtered", 5);
  const auto first = sensor->create_timer("timer", 10ms, [&] { note(), raw->publish(Number{}); });
  const auto second = filter->create_subscription<Number>(
      "raw", 5, [&](const Number&) { note(), filtered->publish(Number{}); });
  const auto third =
      actor->create_subscription<Number>("filtered", 5, [&](const Number&) { note(); });
  for (const auto& node : {sensor, filter, actor}) executor->add_node(node);
  const ManualSpin spin(*executor, clock, is_isolated() ? 4 : 1);
  clock.advance(25ms);
  ASSERT_EQ(steps.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(steps[i].second, TimePoint(i < 3 ? 10ms : 20ms));
    EXPECT_EQ(steps[i].first, steps[i / 3 * 3].first);
  }
  EXPECT_NE(steps[0].first, steps[3].first);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceTime);

}  // namespace
}  // namespace takt::conformance
