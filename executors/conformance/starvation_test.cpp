// Nobody starves, and under some schedulers there is a number for how long one waits. The numbers
// in the comments are those of the rclcpp issues whose defect is tested; #2360, #2402 and #2912
// are in conformance_order_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <random>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceStarvation : public Conformance {};

// Teper et al. (EMSOFT 2024): 1.51 of two threads are used, and rclcpp never runs the last timer:
// its group is busy at each polling point.
TEST_P(ConformanceStarvation, TheLastTimerOfTheCounterexampleRuns) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 2);
  const auto node = make_node(clock);
  std::vector<int> ran(4, 0);
  std::vector<std::shared_ptr<void>> parts;
  const auto add = [&](const std::string& group, std::size_t i, Nanoseconds work) {
    const auto known = node->groups();
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const auto& other) { return other->name() == group; });
    parts.push_back(node->create_timer(
        "timer_" + std::to_string(i), 10ms, [&, i, work] { clock.work(work), ++ran[i]; },
        found != known.end()
            ? *found
            : node->create_callback_group(group, CallbackGroupType::MutuallyExclusive)));
  };
  add("first", 0, 5ms);
  add("second", 1, 5ms);
  add("shared", 2, 5ms);
  add("shared", 3, 100us);
  executor->add_node(node);
  {
    const std::size_t isolated = is_per_group() ? 4 : 2;
    const ManualSpin spin(*executor, clock, is_isolated() ? isolated : is_pool() ? 2 : 1);
    clock.advance(1s);
  }
  if (!is_pool() && !is_isolated()) {  // never idle
    EXPECT_NEAR(5.0 * (ran[0] + ran[1] + ran[2]) + 0.1 * ran[3], 1000, 6);
  }
  for (const int& others : ran) {
    if (is_pool()) {  // the last one may run when its next release is due, too: two are one
      EXPECT_NEAR(others, 100, &others == &ran[3] ? 52 : 2);
    } else {  // one thread has too much to do, and may give each group the same
      EXPECT_GE(2 * ran[3], others - 2);
      EXPECT_LE(ran[3], 100);
    }
  }
}

// rclcpp #2360 with one more timer: a parked callback must come before those that were parked
// later. Otherwise two of them take turns forever, and the others starve.
TEST_P(ConformanceStarvation, TimersOfOneExclusiveGroupThatAreAlwaysReadyTakeTurns) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 3);
  const auto node = make_node(clock);
  std::vector<int> ran(4, 0);
  std::vector<std::shared_ptr<void>> timers;
  for (std::size_t i = 0; i < ran.size(); ++i) {
    timers.push_back(node->create_timer("timer_" + std::to_string(i), 5ms,
                                        [&, i] { clock.work(5ms), ++ran[i]; }));
  }
  executor->add_node(node);
  {
    const ManualSpin spin(*executor, clock, is_isolated() ? 2 : is_pool() ? 3 : 1);
    clock.advance(1s);
  }
  for (const int others : ran) EXPECT_NEAR(others, 50, 2);
}

// #2645: of the two subscriptions of a node one got nothing; of two such nodes too.
TEST_P(ConformanceStarvation, BothSubscriptionsOfABusyNodeAreServed) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock, 3);
  const auto producer = make_node(clock, "producer");
  const auto to_a = producer->create_publisher<Number>("a", 100);
  const auto to_b = producer->create_publisher<Number>("b", 100);
  const auto timer = producer->create_timer("timer", 1ms, [&] {
    to_a->publish(Number{});
    to_b->publish(Number{});
  });
  std::vector<int> received(4, 0);
  std::vector<std::shared_ptr<void>> parts;
  executor->add_node(producer);
  for (std::size_t i = 0; i < received.size(); i += 2) {
    const auto consumer = make_node(clock, "consumer_" + std::to_string(i));
    for (const std::size_t k : {i, i + 1}) {
      parts.push_back(consumer->create_subscription<Number>(
          k == i ? "a" : "b", 100, [&, k](const Number&) { clock.work(3ms), ++received[k]; }));
    }
    executor->add_node(consumer);
    parts.push_back(consumer);
  }
  {
    const ManualSpin spin(*executor, clock, is_isolated() ? 4 : is_pool() ? 3 : 1);
    clock.advance(2s);
  }
  // 2 s of 3 ms each: all four on one thread, or two on each of two.
  const int each = is_pool() || is_isolated() ? 2000 / 6 : 2000 / 12;
  for (const int count : received) EXPECT_NEAR(count, each, 1);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceStarvation);

// ---- How long one waits ----

// Counts, for each callback that is ready, the dispatches that begin before its own. Those that
// begin while an exclusive group is busy with another of its callbacks do not count for it: they
// take nothing from it. All under a manual clock, where one thread runs at a time.
class ConformanceWaiting : public Conformance {
 protected:
  struct Callback {
    std::shared_ptr<Entity> entity;
    std::size_t depth;  // how much of it may wait
    std::function<void()> make_ready;
    std::size_t waits = 0, longest_wait = 0;
  };

  void add_group(const std::string& name, CallbackGroupType type, std::vector<std::size_t> depths) {
    const auto group = node_->create_callback_group(name, type);
    for (const std::size_t depth : depths) {
      const std::string topic = "topic_" + std::to_string(callbacks_.size());
      const auto publisher = node_->create_publisher<Number>(topic, depth);
      add(node_->create_subscription<Number>(topic, depth, runs<const Number&>(), group), depth,
          [publisher] { publisher->publish(Number{}); });
    }
    add(node_->create_timer(name + "_timer", 7ms, runs<>(), group), 1, nullptr);
    const auto guard = node_->create_guard_condition(name + "_guard", runs<>(), group);
    add(guard, 1, [guard] { guard->trigger(); });
  }

  void run(std::size_t threads) {
    executor_ = make_with(threads);
    is_busy_.assign(3, false);
    add_group("a", CallbackGroupType::MutuallyExclusive, {1, 3});
    add_group("b", CallbackGroupType::MutuallyExclusive, {2});
    add_group("c", CallbackGroupType::Reentrant, {1, 3});
    executor_->add_node(node_);
    const ManualSpin spin(*executor_, clock_, is_isolated() ? 2 : threads);
    for (int step = 0; step < 1000; ++step) {
      load_ = step / 100 % 2 == 0 ? 2 : 6;  // some of the time everything is always ready
      make_some_ready(6);
      clock_.advance(random_() % 40 * 100us);
    }
  }

  std::unique_ptr<Executor> make_with(std::size_t threads) {
    ExecutorOptions options{.name = "waiting", .scheduler = scheduler_name(), .clock = &clock_};
    options.threads.resize(threads);
    return executors().make(executor_name(), options);
  }

  // What the cards of the schedulers promise.
  std::size_t bound(const Callback& callback) const {
    const std::size_t others = callbacks_.size() - 1;
    std::size_t older = 0, older_mates = 0;  // what may have arrived before
    for (const Callback& other : callbacks_) {
      if (&other == &callback) continue;
      older += other.depth;
      if (other.entity->group() == callback.entity->group()) older_mates += other.depth;
    }
    if (scheduler_name() == "ros" || (!is_event_driven() && !is_pool())) return 2 * others;
    const std::size_t in_order =
        scheduler_name() == "fifo" ? older : (older_mates + 1) * is_busy_.size() - 1;
    return is_pool() ? others + in_order : in_order;
  }

  std::vector<Callback> callbacks_;

 private:
  template <class... Arguments>
  std::function<void(Arguments...)> runs() {
    return [this, i = callbacks_.size(), group = node_->groups().size() - 2](Arguments...) {
      begin(i, group);
      make_some_ready(load_);
      clock_.work(random_() % 20 * 100us);
      make_some_ready(load_);
      if (callbacks_[i].entity->group()->type() == CallbackGroupType::MutuallyExclusive) {
        is_busy_[group] = false;
      }
    };
  }

  void add(const std::shared_ptr<Entity>& entity, std::size_t depth,
           std::function<void()> make_ready) {
    callbacks_.push_back({entity, depth, std::move(make_ready)});
    groups_.push_back(node_->groups().size() - 2);  // without "default"
  }

  void begin(std::size_t i, std::size_t group) {
    for (std::size_t k = 0; k < callbacks_.size(); ++k) {
      Callback& other = callbacks_[k];
      if (k == i || other.entity->ready_count() == 0 || is_busy_[groups_[k]]) continue;
      other.longest_wait = std::max(other.longest_wait, ++other.waits);
    }
    callbacks_[i].waits = 0;
    if (callbacks_[i].entity->group()->type() == CallbackGroupType::MutuallyExclusive) {
      is_busy_[group] = true;
    }
  }

  void make_some_ready(unsigned long most) {
    for (auto left = random_() % (most + 1); left != 0; --left) {
      const Callback& callback = callbacks_[random_() % callbacks_.size()];
      if (callback.make_ready) callback.make_ready();
    }
  }

  std::minstd_rand random_{5};
  unsigned long load_ = 0;
  ManualClock clock_{TimePoint{}, virtual_cpus()};
  std::shared_ptr<Node> node_ = make_node(clock_);
  std::vector<std::size_t> groups_;  // of each callback
  std::vector<bool> is_busy_;        // each exclusive group
  std::unique_ptr<Executor> executor_;
};

TEST_P(ConformanceWaiting, NoCallbackWaitsForMoreDispatchesThanPromised) {
  run(is_isolated() ? 1 : std::min<std::size_t>(most_workers(), 3));
  for (const Callback& callback : callbacks_) {
    EXPECT_GT(callback.longest_wait, 0u) << callback.entity->name();
    EXPECT_LE(callback.longest_wait, bound(callback)) << callback.entity->name();
  }
}

INSTANTIATE_TEST_SUITE_P(Every, ConformanceWaiting,
                         ::testing::Combine(::testing::ValuesIn(executors().names()),
                                            ::testing::Values("fifo", "ros", "round_robin")),
                         [](const auto& pair) {
                           return std::get<0>(pair.param) + "__" + std::get<1>(pair.param);
                         });

}  // namespace
}  // namespace takt::conformance
