// How long a due timer waits for a look at the clock.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/timer_queue.hpp"

#include <memory>

#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt::detail {
namespace {

using namespace std::chrono_literals;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test/msg/Number", value);

/// How many messages were served between the release of an urgent timer and its callback, of 400
/// that wait: 200 brief ones, and then `work` each.
int served_before_the_timer(Nanoseconds work) {
  ManualClock clock{TimePoint(1s)};
  ExecutorOptions options;
  options.scheduler = "fixed_priority";
  options.statistics = StatisticsLevel::count;
  options.clock = &clock;
  const auto executor = executors().make("events", options);
  const auto node = std::make_shared<Node>("node", NodeOptions{.clock = &clock});
  const auto publisher = node->create_publisher<Number>("topic", 400);
  int served = 0, late = 0;
  TimePoint due{};
  const auto subscription = node->create_subscription<Number>("topic", 400, [&](const Number&) {
    clock.work(++served <= 200 ? 10ns : work);
    if (clock.now() >= due) ++late;
  });
  const auto timer = node->create_timer("timer", 1min, [&] { due = kNever; });
  timer->set_parameters({.priority = 1});
  executor->add_node(node);
  executor->spin_some();
  due = clock.now() + 200 * 10ns + 50 * work;
  timer->release_at(due);
  for (int i = 0; i < 400; ++i) publisher->publish(Number{});
  executor->spin_all();
  EXPECT_EQ(served, 400);
  EXPECT_EQ(due, kNever);
  return late;
}

// With a look at every 64 brief callbacks, a due timer waited for 64 that had become long.
TEST(TimerQueue, ADueTimerWaitsForSixteenCallbacksAtMost) {
  for (const Nanoseconds work : {Nanoseconds(20ns), Nanoseconds(1us), Nanoseconds(5us),
                                 Nanoseconds(1ms), Nanoseconds(100ms)}) {
    EXPECT_LE(served_before_the_timer(work), 16) << work.count() << " ns";
  }
  // As soon as they are known to be long, there is a look after each.
  EXPECT_LE(served_before_the_timer(5us), 1);
}

TEST(TimerQueue, OfTimersThatAreDueTogetherTheFirstAddedIsFirst) {
  ManualClock clock{TimePoint(1s)};
  const auto executor = executors().make("events", {.clock = &clock});
  const auto node = std::make_shared<Node>("node", NodeOptions{.clock = &clock});
  std::string trace;
  const auto a = node->create_timer("a", 10ms, [&] { trace += "a"; });
  const auto b = node->create_timer("b", 10ms, [&] { trace += "b"; });
  const auto c = node->create_timer("c", 10ms, [&] { trace += "c"; });
  executor->add_node(node);
  for (int i = 0; i < 2; ++i) {
    clock.advance(10ms);
    executor->spin_all();
  }
  EXPECT_EQ(trace, "abcabc");
}

}  // namespace
}  // namespace takt::detail
