// In which order callbacks run, and that none is overtaken for ever. Run for every executor under
// every scheduler. The numbers in the comments are those of the rclcpp issues (or the project)
// whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

class ConformanceOrder : public Conformance {};

TEST_P(ConformanceOrder, RunsWhatIsReadyInTheSchedulersOrder) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 1);
  const auto node = make_node(clock);
  std::vector<std::string> trace;
  const auto note = [&trace](const char* what) {
    return [&trace, what] { trace.push_back(what); };
  };

  // Registered, group by group: low, timer, guard; high. Arriving: guard, low, high, timer.
  // timer → low is a chain. `timer` has the first deadline, `high` the least laxity.
  const auto modest = node->create_callback_group("modest", CallbackGroupType::MutuallyExclusive);
  const auto urgent = node->create_callback_group("urgent", CallbackGroupType::MutuallyExclusive);
  const auto low = node->create_subscription<Number>(
      "low", 5, [&](const Number&) { trace.push_back("low"); }, modest);
  low->set_parameters({.deadline = 30ms, .budget = 15ms});
  const auto high = node->create_subscription<Number>(
      "high", 5, [&](const Number&) { trace.push_back("high"); }, urgent);
  high->set_parameters({.priority = 10, .deadline = 25ms, .budget = 12ms});
  const auto timer = node->create_timer("timer", 10ms, note("timer"), modest);
  timer->set_parameters({.deadline = 8ms, .budget = 1ms});
  const auto guard = node->create_guard_condition("guard", note("guard"), modest);
  const auto to_low = node->create_publisher<Number>("low", 5);
  const auto to_high = node->create_publisher<Number>("high", 5);
  const auto chain = Chain::create({.name = "chain"}, {{node, "timer"}, {node, "low"}});
  executor->add_node(node);
  executor->spin_some();  // installs the callbacks; nothing is ready
  ASSERT_TRUE(trace.empty());

  guard->trigger();
  to_low->publish(Number{1});
  to_high->publish(Number{2});
  clock.work(10ms);
  executor->spin_some();

  const std::map<std::string, std::vector<std::string>> orders = {
      {"chain_edf", {"guard", "low", "high", "timer"}},  // without a deadline of the chain
      {"chain_priority", {"low", "timer", "high", "guard"}},
      {"edf", {"timer", "high", "low", "guard"}},
      {"fifo", {"guard", "low", "high", "timer"}},
      {"fixed_priority", {"high", "guard", "low", "timer"}},
      {"job_priority", {"low", "timer", "high", "guard"}},
      {"least_laxity", {"high", "low", "timer", "guard"}},
      {"listed", {"low", "timer", "guard", "high"}},
      {"ros", {"timer", "low", "high", "guard"}},
      {"round_robin", {"guard", "high", "low", "timer"}},
  };
  ASSERT_THAT(trace, UnorderedElementsAre("guard", "high", "low", "timer"));
  const auto order = orders.find(scheduler_name());
  if (order == orders.end()) GTEST_SKIP() << "a scheduler that is not ours";
  std::vector<std::string> expected = order->second;
  if (is_per_group()) {  // two threads have no order between them
    std::erase(expected, "high");
    std::erase(trace, "high");
  }
  EXPECT_EQ(trace, expected);
}

// The iRobot events executor serves another order in spin_some than in spin.
// What `takt plan` and bounds believe of an executor. The order of urgent callbacks shows whether
// it looks for new messages between two of a snapshot.
TEST_P(ConformanceOrder, ReadinessIsWhatTheTraitsSay) {
  if (is_isolated()) GTEST_SKIP() << "each thread has an order of its own";
  ManualClock clock{TimePoint{}, virtual_cpus()};
  ExecutorOptions options;
  options.name = "conformance";
  options.scheduler = "fixed_priority";
  options.clock = &clock;
  if (is_pool()) options.threads.resize(1);
  const auto executor = make(options);
  const auto node = make_node(clock);
  std::vector<std::string> trace;
  const auto to_first = node->create_publisher<Number>("first", 5);
  const auto to_second = node->create_publisher<Number>("second", 5);
  const auto to_urgent = node->create_publisher<Number>("urgent", 5);
  const auto first = node->create_subscription<Number>("first", 5, [&](const Number& number) {
    trace.emplace_back("first");
    to_urgent->publish(number);
  });
  const auto second = node->create_subscription<Number>(
      "second", 5, [&](const Number&) { trace.emplace_back("second"); });
  const auto urgent = node->create_subscription<Number>(
      "urgent", 5, [&](const Number&) { trace.emplace_back("urgent"); });
  urgent->set_parameters({.priority = 10});
  executor->add_node(node);
  executor->spin_some();
  to_first->publish(Number{1});
  to_second->publish(Number{2});
  executor->spin_all();
  if (is_event_driven()) {
    EXPECT_THAT(trace, ElementsAre("first", "urgent", "second"));
  } else {
    EXPECT_THAT(trace, ElementsAre("first", "second", "urgent"));
  }
}

TEST_P(ConformanceOrder, SpinAndSpinSomeKeepTheSameOrder) {
  const auto run = [&](bool with_spin) {
    ManualClock clock{TimePoint{}, virtual_cpus()};
    const auto executor = make(clock, 1);
    const auto node = make_node(clock);
    std::vector<std::string> trace;
    std::vector<std::shared_ptr<void>> parts;
    std::vector<std::shared_ptr<Publisher<Number>>> publishers;
    for (int i = 0; i < 4; ++i) {
      const std::string topic = "topic_" + std::to_string(i);
      parts.push_back(node->create_subscription<Number>(
          topic, 5, [&trace, topic](const Number&) { trace.push_back(topic); }));
      publishers.push_back(node->create_publisher<Number>(topic, 5));
    }
    parts.push_back(node->create_timer("timer", 1ms, [&] { trace.push_back("timer"); }));
    executor->add_node(node);
    executor->spin_some();
    const auto publish = [&] {
      for (const int i : {2, 0, 3, 1}) publishers[static_cast<std::size_t>(i)]->publish(Number{i});
    };
    if (with_spin) {
      const ManualSpin spin(*executor, clock, is_isolated() ? 2 : 1);
      publish();
      clock.advance(1ms);
    } else {
      publish();
      clock.work(1ms);
      executor->spin_some();
    }
    return trace;
  };
  // In spin the messages wake the executor before the timer is due.
  auto spun = run(true);
  auto some = run(false);
  EXPECT_EQ(spun.size(), 5u);
  std::erase(spun, "timer");
  std::erase(some, "timer");
  EXPECT_EQ(spun, some);
}

TEST_P(ConformanceOrder, TheSameRunGivesTheSameTrace) {
  const auto run = [&] {
    ManualClock clock{TimePoint{}, virtual_cpus()};
    const auto executor = make(clock);
    std::vector<std::shared_ptr<Node>> nodes;
    std::vector<std::shared_ptr<void>> parts;
    std::vector<std::string> trace;
    for (int i = 0; i < 3; ++i) {
      const auto node = make_node(clock, "node_" + std::to_string(i));
      const auto publisher = node->create_publisher<Number>("t" + std::to_string(i), 5);
      parts.push_back(node->create_timer("timer", 2ms + i * 1ms, [&, i, publisher] {
        trace.push_back("timer " + std::to_string(i));
        clock.work(300us);
        publisher->publish(Number{i});
      }));
      parts.push_back(node->create_subscription<Number>(
          "t" + std::to_string((i + 1) % 3), 5, [&, i](const Number& number) {
            clock.work(500us);
            trace.push_back(std::to_string(i) + " got " + std::to_string(number.value));
          }));
      executor->add_node(node);
      nodes.push_back(node);
    }
    const ManualSpin spin(*executor, clock, is_isolated() ? 4 : workers());
    clock.advance(100ms);
    return trace;
  };
  const auto first = run();
  // 108 releases, each with a message; some of the last are not over when the time is.
  EXPECT_NEAR(static_cast<double>(first.size()), 2 * 108, 3);
  EXPECT_EQ(first, run());
}

// A ready callback is not overtaken for ever: #2360, #2702, Teper et al. (EMSOFT 2024).
TEST_P(ConformanceOrder, TwoEqualTimersOfOneExclusiveGroupAlternate) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<char> trace;
  // Each takes longer than its period, so both are always ready.
  const auto a = node->create_timer("a", 10ms, [&] { clock.work(15ms), trace.push_back('a'); });
  const auto b = node->create_timer("b", 10ms, [&] { clock.work(15ms), trace.push_back('b'); });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(1s);
  ASSERT_EQ(trace.size(), 66u);  // 15 ms each, in a second
  for (std::size_t i = 1; i < trace.size(); ++i) ASSERT_NE(trace[i], trace[i - 1]) << i;
}

// A pool that looked whether there is more to run put the first behind the others.
TEST_P(ConformanceOrder, ReceiversOfOneMessageRunAsTheyWereAnnounced) {
  if (scheduler_name() != "fifo" || is_isolated()) GTEST_SKIP() << "it has another order of these";
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<int> trace;
  std::vector<std::shared_ptr<void>> parts;
  for (int i = 0; i < 5; ++i) {
    const auto group =
        node->create_callback_group("g" + std::to_string(i), CallbackGroupType::MutuallyExclusive);
    const auto receive = [&, i](const Number&) { trace.push_back(i), clock.work(1ms); };
    parts.push_back(node->create_subscription<Number>("topic", 5, receive, group));
  }
  const auto publisher = node->create_publisher<Number>("topic", 5);
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  publisher->publish(Number{});
  clock.advance(100ms);
  EXPECT_THAT(trace, ElementsAre(0, 1, 2, 3, 4));
}

// A worker keeps what its own callbacks announce elsewhere than what other threads announce.
TEST_P(ConformanceOrder, ASnapshotKeepsTheOrderOfWhatThreadsAndCallbacksAnnounce) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  if (is_event_driven() || is_isolated()) GTEST_SKIP() << "it serves no snapshots of the whole";
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  std::vector<std::string> trace;
  std::vector<std::shared_ptr<GuardCondition>> guards;
  const auto add = [&](const std::string& name, std::function<void()> callback) {
    guards.push_back(node->create_guard_condition(
        name,
        [&trace, name, callback] {
          trace.push_back(name);
          callback();
        },
        node->create_callback_group(name, CallbackGroupType::MutuallyExclusive)));
  };
  add("of_a_thread", [] {});
  add("of_a_callback", [] {});
  add("running", [&] {
    std::thread([&] { guards[0]->trigger(); }).join();
    guards[1]->trigger();
  });
  executor->add_node(node);
  guards[2]->trigger();
  executor->spin_all();
  EXPECT_THAT(trace, ElementsAre("running", "of_a_thread", "of_a_callback"));
}

// #2402, #392: a timer that is always ready starves the subscriptions.
TEST_P(ConformanceOrder, ASlowTimerDoesNotStopSubscriptions) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int timers = 0, messages = 0;
  const auto publisher = node->create_publisher<Number>("topic", 1);
  const auto slow = node->create_timer("slow", 1ms, [&] {
    clock.work(3ms);
    ++timers;
    publisher->publish(Number{timers});
  });
  const auto subscription = node->create_subscription<Number>(
      "topic", 1, [&](const Number&) { clock.work(1ms), ++messages; });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(1s);
  EXPECT_NEAR(3 * timers + messages, 1000, 3);  // never idle
  EXPECT_GE(messages, timers / 2 - 1);
  EXPECT_LE(messages, timers);
}

// #2912: of two saturated subscriptions one got most of the turns, depending on their order.
TEST_P(ConformanceOrder, HeavyAndLightSubscriptionsRunInTurnWhateverTheirOrder) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  for (const bool heavy_first : {true, false}) {
    ManualClock clock{TimePoint{}, virtual_cpus()};
    const auto executor = make(clock);
    const auto node = make_node(clock);
    int heavy = 0, light = 0;
    std::vector<std::shared_ptr<void>> parts;
    const auto make_heavy = [&] {
      parts.push_back(node->create_subscription<Number>(
          "heavy", 1, [&](const Number&) { clock.work(4ms), ++heavy; }));
    };
    if (heavy_first) make_heavy();
    parts.push_back(node->create_subscription<Number>(
        "light", 1, [&](const Number&) { clock.work(1ms), ++light; }));
    if (!heavy_first) make_heavy();
    executor->add_node(node);

    const auto source = make_node(clock, "source");
    const auto to_heavy = source->create_publisher<Number>("heavy", 1);
    const auto to_light = source->create_publisher<Number>("light", 1);
    const ManualSpin spin(*executor, clock, participants());
    for (int i = 0; i < 2000; ++i) {
      to_heavy->publish(Number{});
      to_light->publish(Number{});
      clock.advance(500us);
    }
    EXPECT_EQ(heavy, 200) << "heavy first: " << heavy_first;
    EXPECT_EQ(light, 200) << "heavy first: " << heavy_first;
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceOrder);

}  // namespace
}  // namespace takt::conformance
