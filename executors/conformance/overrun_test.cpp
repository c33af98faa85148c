// Deadlines, budgets, chains, and what follows when they are not kept. Run for every executor under
// every scheduler.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt::conformance {
namespace {

class ConformanceOverrun : public Conformance {
 protected:
  std::unique_ptr<Executor> make_with(const std::shared_ptr<Watchdog>& watchdog) {
    ExecutorOptions options{.name = "conformance",
                            .scheduler = scheduler_name(),
                            .watchdog = watchdog,
                            .clock = &clock_};
    if (is_pool()) options.threads.resize(workers());
    return make(options);
  }
  int now_ms() const { return static_cast<int>(clock_.now().time_since_epoch() / 1ms); }
  static CallbackStatistics find(const Executor& executor, const std::string& callback) {
    for (CallbackStatistics& statistics : executor.statistics()) {
      if (statistics.callback == callback) return std::move(statistics);
    }
    return {};
  }

  ManualClock clock_{TimePoint{}, virtual_cpus()};
  std::shared_ptr<Node> node_ = make_node(clock_);
  std::vector<int> misses_, overruns_, starts_;
};

TEST_P(ConformanceOverrun, CountsAndReportsMissesAndOverrunsWhenTheCallbackReturns) {
  int run = 0;
  const auto timer =
      node_->create_timer("timer", 10ms, [&] { clock_.work(++run == 2 ? 7ms : 2ms); });
  timer->set_parameters({.deadline = 5ms,
                         .budget = 3ms,
                         .on_deadline_miss =
                             [&](const OverrunReport& report) {
                               misses_.push_back(now_ms());
                               EXPECT_EQ(report.node, "/node");
                               EXPECT_EQ(report.callback, "timer");
                               EXPECT_EQ(report.ready_time, TimePoint(20ms));
                               EXPECT_EQ(report.deadline, TimePoint(25ms));
                               EXPECT_EQ(report.end, TimePoint(27ms));
                             },
                         .on_overrun =
                             [&](const OverrunReport& report) {
                               overruns_.push_back(now_ms());
                               EXPECT_EQ(report.execution_time, 7ms);
                               EXPECT_EQ(report.budget, 3ms);
                             }});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(49ms);
    timer->cancel();
  }
  EXPECT_THAT(misses_, ElementsAre(27));
  EXPECT_THAT(overruns_, ElementsAre(27));
  EXPECT_EQ(find(*executor, "timer").deadline_misses, 1u);
  EXPECT_EQ(find(*executor, "timer").overruns, 1u);
}

// In a pool, what a callback announced to itself was looked for when the user's function returned,
// and its handler is called later: where nothing else had announced the callback meanwhile, the
// third message waited until somebody sent a fourth.
TEST_P(ConformanceOverrun, AHandlerMaySendToTheCallbackThatItReportsOn) {
  const auto publisher = node_->create_publisher<Number>("topic", 5);
  int received = 0;
  const auto subscription = node_->create_subscription<Number>("topic", 5, [&](const Number&) {
    if (++received == 1) std::thread([&] { publisher->publish(Number{}); }).join();
    clock_.work(2ms);
  });
  subscription->set_parameters({.budget = 1ms, .on_overrun = [&](const OverrunReport&) {
                                  if (received == 2) publisher->publish(Number{});
                                }});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  publisher->publish(Number{});
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(10ms);
  }
  EXPECT_EQ(received, 3);
}

TEST_P(ConformanceOverrun, AWatchdogReportsAtTheDeadlineAndOnlyOnce) {
  const auto watchdog =
      std::make_shared<Watchdog>(ThreadAttributes{.name = "watchdog"}, Realtime::off, clock_);
  int run = 0;
  const auto timer =
      node_->create_timer("timer", 10ms, [&] { clock_.work(++run == 2 ? 17ms : 2ms); });
  timer->set_parameters({.deadline = 5ms, .on_deadline_miss = [&](const OverrunReport& report) {
                           misses_.push_back(now_ms());
                           EXPECT_EQ(report.end, kNever);
                         }});
  auto executor = make_with(watchdog);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants() + 1);
    clock_.advance(64ms);
    timer->cancel();
  }
  // Released at 20, ends at 37; the release of 30, which is served then, has missed by that time.
  EXPECT_THAT(misses_, ElementsAre(25, 37));
  EXPECT_EQ(find(*executor, "timer").deadline_misses, 2u);
  executor.reset();
}

// The handler was called with the watchdog's mutex held.
TEST_P(ConformanceOverrun, AHandlerOnTheWatchdogMayMakeAnExecutorForIt) {
  const auto watchdog =
      std::make_shared<Watchdog>(ThreadAttributes{.name = "watchdog"}, Realtime::off, clock_);
  const auto timer = node_->create_timer("timer", 10ms, [&] { clock_.work(7ms); });
  int made = 0;
  timer->set_parameters({.deadline = 5ms, .on_deadline_miss = [&](const OverrunReport&) {
                           make_with(watchdog);
                           ++made;
                         }});
  auto executor = make_with(watchdog);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants() + 1);
    clock_.advance(18ms);
    timer->cancel();
  }
  EXPECT_EQ(made, 1);
  executor.reset();
}

// The deadline of the second execution took the place of the first one's.
TEST_P(ConformanceOverrun, AWatchdogReportsEveryExecutionOfAReentrantGroup) {
  if (reentrant_workers() == 1) GTEST_SKIP() << "one worker: one execution at a time";
  const auto watchdog =
      std::make_shared<Watchdog>(ThreadAttributes{.name = "watchdog"}, Realtime::off, clock_);
  const auto group = node_->create_callback_group("group", CallbackGroupType::Reentrant);
  const auto subscription = node_->create_subscription<Number>(
      "topic", 5, [&](const Number&) { clock_.work(20ms); }, group);
  subscription->set_parameters({.deadline = 5ms, .on_deadline_miss = [&](const OverrunReport&) {
                                  misses_.push_back(now_ms());
                                }});
  const auto publisher = node_->create_publisher<Number>("topic", 5);
  auto executor = make_with(watchdog);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants(CallbackGroupType::Reentrant) + 1);
    clock_.advance(1ms);
    publisher->publish(Number{1});
    clock_.advance(3ms);
    publisher->publish(Number{2});
    clock_.advance(40ms);
  }
  EXPECT_THAT(misses_, ElementsAre(6, 9));
  executor.reset();
}

TEST_P(ConformanceOverrun, SkipServesNoReleaseThatCameMeanwhile) {
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    starts_.push_back(now_ms());
    clock_.work(starts_.size() == 2 ? 25ms : 1ms);
  });
  timer->set_parameters({.overrun = OverrunPolicy::skip});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, participants());
  clock_.advance(75ms);
  EXPECT_THAT(starts_, ElementsAre(10, 20, 50, 60, 70));  // without: 10, 20, 45, 50, …
  EXPECT_EQ(timer->missed(), 2u);
}

TEST_P(ConformanceOverrun, AbortEndsTheChainInstance) {
  const auto publisher = node_->create_publisher<Number>("number", 5);
  int run = 0;
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    publisher->publish(Number{++run});
    clock_.work(run == 2 ? 7ms : 2ms);
  });
  timer->set_parameters({.deadline = 5ms, .overrun = OverrunPolicy::abort});
  std::vector<int> received;
  const auto subscription = node_->create_subscription<Number>(
      "number", 5, [&](const Number& number) { received.push_back(number.value); });
  const auto chain = Chain::create({.name = "chain"}, {{node_, "timer"}, {node_, "number"}});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(49ms);
    timer->cancel();
  }
  EXPECT_THAT(received, ElementsAre(1, 3, 4));
  EXPECT_EQ(find(*executor, "number").dropped, 1u);
  EXPECT_EQ(chain->statistics().instances, 3u);
  EXPECT_EQ(chain->statistics().aborted, 1u);
}

TEST_P(ConformanceOverrun, DemotePutsItBehindAllOthersUntilItKeepsItsTime) {
  // Both become ready while the executor is busy with the third.
  std::vector<std::string> trace;
  const auto busy = node_->create_callback_group("busy", CallbackGroupType::MutuallyExclusive);
  int run = 0;
  const auto urgent = node_->create_timer("urgent", 10ms, [&] {
    trace.push_back("urgent");
    clock_.work(++run == 1 ? 3ms : 1ms);
  });
  urgent->set_parameters({.priority = 10, .budget = 2ms, .overrun = OverrunPolicy::demote});
  const auto modest = node_->create_timer("modest", 10ms, [&] { trace.push_back("modest"); });
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, participants());
  clock_.advance(39ms);
  if (schedulers().traits(scheduler_name()).order == analysis::Order::by_urgency) {
    EXPECT_THAT(trace, ElementsAre("urgent", "modest", "modest", "urgent", "urgent", "modest"));
  } else {
    EXPECT_EQ(trace.size(), 6u);  // whose order knows no priorities
  }
}

// A callback that nobody checks any more would have stayed demoted for ever.
TEST_P(ConformanceOverrun, AnotherPolicyEndsADemotion) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  std::vector<std::string> trace;
  int run = 0;
  const auto urgent = node_->create_timer("urgent", 10ms, [&] {
    trace.push_back("urgent");
    if (++run != 1) return;
    node_->set_callback_parameters(
        {.callbacks = {{"urgent", {.overrun = OverrunPolicy::catch_up}}}});
    clock_.work(11ms);
  });
  urgent->set_parameters({.priority = 10, .overrun = OverrunPolicy::demote});
  const auto modest = node_->create_timer("modest", 10ms, [&] { trace.push_back("modest"); });
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, participants());
  clock_.advance(35ms);
  EXPECT_EQ(trace.size(), 5u);
  if (schedulers().traits(scheduler_name()).order == analysis::Order::by_urgency) {
    EXPECT_EQ(trace.back(), "modest");
  }
}

// ---- Chains ----

TEST_P(ConformanceOverrun, MeasuresAChainFromReleaseToEndAndOnlyItsOwnInstances) {
  // fast ─┬→ relay → sink   fast → sink is not the chain, and slow → relay → sink neither.
  // slow ─┘
  const auto middle = node_->create_publisher<Number>("middle", 5);
  const auto end = node_->create_publisher<Number>("end", 5);
  const auto fast = node_->create_timer("fast", 10ms, [&] {
    clock_.work(1ms);
    middle->publish(Number{1});
    end->publish(Number{1});
  });
  const auto slow = node_->create_timer("slow", 15ms, [&] { middle->publish(Number{2}); });
  const auto relay = node_->create_subscription<Number>("middle", 5, [&](const Number& number) {
    clock_.work(2ms);
    end->publish(number);
  });
  const auto sink =
      node_->create_subscription<Number>("end", 5, [&](const Number&) { clock_.work(500us); });
  const auto chain = Chain::create({.name = "chain", .priority = 7, .deadline = 100ms},
                                   {{node_, "fast"}, {node_, "middle"}, {node_, "end"}});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(99ms);
    fast->cancel();
    slow->cancel();
  }
  const ChainStatistics statistics = chain->statistics();
  EXPECT_EQ(statistics.instances, 9u);
  EXPECT_EQ(statistics.misses, 0u);
  EXPECT_EQ(statistics.aborted, 0u);
  // Alone, 3.5 ms. Before the chain's end come, by scheduler, the sink's other message (0.5 ms),
  // and at every third release the relay and sink of `slow` (2.5 ms).
  EXPECT_GE(statistics.latency.min(), 3500us);
  EXPECT_LE(statistics.latency.min(), 4ms);
  EXPECT_LE(statistics.latency.max(), 6500us);
}

// left → fuse(left) ─┬→ sink   The instances of both timers are in the fused message, which was
// once right → fuse(right)┘          counted for the input that came last alone.
TEST_P(ConformanceOverrun, BothChainsGoOnThroughAJoin) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  const auto left = node_->create_publisher<Number>("left", 5);
  const auto right = node_->create_publisher<Number>("right", 5);
  const auto fused = node_->create_publisher<Number>("fused", 5);
  const auto fast = node_->create_timer("fast", 10ms, [&] { left->publish(Number{}); });
  const auto slow = node_->create_timer("slow", 30ms, [&] {
    clock_.work(1ms);
    right->publish(Number{});
  });
  ChainJoin join(2);
  bool has_left = false, has_right = false;
  const auto fuse = [&] {
    if (!has_left || !has_right) return;
    has_left = has_right = false;
    join.combine();
    fused->publish(Number{});
  };
  const auto on_left = node_->create_subscription<Number>("left", 5, [&](const Number&) {
    join.received(0);
    has_left = true;
    fuse();
  });
  const auto on_right = node_->create_subscription<Number>("right", 5, [&](const Number&) {
    join.received(1);
    has_right = true;
    fuse();
  });
  const auto sink =
      node_->create_subscription<Number>("fused", 5, [&](const Number&) { clock_.work(1ms); });
  const auto of_fast =
      Chain::create({.name = "fast"}, {{node_, "fast"}, {node_, "left"}, {node_, "fused"}});
  const auto of_slow =
      Chain::create({.name = "slow"}, {{node_, "slow"}, {node_, "right"}, {node_, "fused"}});
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(99ms);
    fast->cancel();
    slow->cancel();
  }
  EXPECT_EQ(of_fast->statistics().instances, 3u);
  EXPECT_EQ(of_slow->statistics().instances, 3u);
  EXPECT_EQ(of_slow->statistics().latency.min(), 2ms);
  EXPECT_EQ(of_slow->statistics().latency.max(), 2ms);
  EXPECT_EQ(of_fast->statistics().latency.min(), 2ms);
  EXPECT_EQ(of_fast->statistics().latency.max(), 2ms);
}

// ---- Parameters that change ----

TEST_P(ConformanceOverrun, ParametersChangeTogetherBetweenTwoCallbacks) {
  std::vector<std::string> trace;
  const auto note = [&](const char* what) { return [&trace, what] { trace.push_back(what); }; };
  const auto a = node_->create_timer("a", 10ms, note("a"));
  const auto b = node_->create_timer("b", 10ms, note("b"));
  const auto change = node_->create_timer("change", 25ms, [&] {
    node_->set_callback_parameters(
        {.callback_groups = {{"default", {.priority = 1}}},
         .callbacks = {{"b", {.priority = 5, .deadline = 3ms}}, {"a", {.deadline = 4ms}}}});
  });
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, participants());
  clock_.advance(45ms);
  if (schedulers().traits(scheduler_name()).order == analysis::Order::by_urgency ||
      scheduler_name() == "edf" || scheduler_name() == "least_laxity") {
    EXPECT_THAT(trace, ElementsAre("a", "b", "a", "b", "b", "a", "b", "a"));
  } else {
    EXPECT_EQ(trace.size(), 8u);
  }
}

TEST_P(ConformanceOverrun, ParametersThatCannotBeChangeNothing) {
  const auto timer = node_->create_timer("timer", 10ms, [&] { starts_.push_back(now_ms()); });
  const auto executor = make_with(nullptr);
  executor->add_node(node_);
  const ManualSpin spin(*executor, clock_, participants());
  const auto change = [&](const CallbackParameterChanges& changes) {
    return [&, changes] { node_->set_callback_parameters(changes); };
  };
  EXPECT_THAT(change({.callbacks = {{"timr", {}}}}),
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("has no callback 'timr'")));
  EXPECT_THAT(change({.callback_groups = {{"default", {.priority = 3}}},
                      .callbacks = {{"timer", {.budget = 20ms}}}}),
              ::testing::ThrowsMessage<Error>(
                  ::testing::HasSubstr("the budget of 20ms is above the period of 10ms")));
  EXPECT_THAT(
      change({.callbacks = {{"timer", {.deadline = 0ms}}}}),
      ::testing::ThrowsMessage<Error>(::testing::HasSubstr("a deadline of 0s cannot be kept")));
  EXPECT_FALSE(node_->default_callback_group()->parameters().priority.has_value());
  clock_.advance(25ms);
  EXPECT_THAT(starts_, ElementsAre(10, 20));
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceOverrun);

}  // namespace
}  // namespace takt::conformance
