// Callbacks that a mode demotes or drops. Run for every executor under every scheduler.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/sched/ranks.hpp"

namespace takt::conformance {
namespace {

class ConformanceServing : public Conformance {
 protected:
  std::unique_ptr<Executor> made(const std::shared_ptr<Watchdog>& watchdog = nullptr) {
    ExecutorOptions options{.name = "conformance",
                            .scheduler = scheduler_name(),
                            .watchdog = watchdog,
                            .clock = &clock_};
    if (is_pool()) options.threads.resize(workers());
    auto executor = make(options);
    executor->add_node(node_);
    return executor;
  }
  void serve(const std::string& callback, Serving serving) {
    node_->set_callback_parameters({.callbacks = {{callback, {.serving = serving}}}});
  }
  CallbackStatistics find(const Executor& executor, const std::string& callback) {
    for (CallbackStatistics& statistics : executor.statistics()) {
      if (statistics.callback == callback) return std::move(statistics);
    }
    return {};
  }

  ManualClock clock_{TimePoint{}, virtual_cpus()};
  std::shared_ptr<Node> node_ = make_node(clock_);
};

TEST_P(ConformanceServing, WhatADroppedCallbackGetsIsCounted) {
  int received = 0, ticks = 0;
  const auto publisher = node_->create_publisher<Number>("topic", 20);
  const auto subscription =
      node_->create_subscription<Number>("topic", 20, [&](const Number&) { ++received; });
  const auto timer = node_->create_timer("timer", 10ms, [&] { ++ticks; });
  const auto executor = made();
  const auto publish = [&](int messages) {
    for (int i = 0; i < messages; ++i) publisher->publish(Number{});
    clock_.settle();
  };
  {
    const ManualSpin spin(*executor, clock_, participants());
    clock_.advance(15ms);
    publish(2);
    serve("topic", Serving::dropped);
    serve("timer", Serving::dropped);
    publish(3);
    clock_.advance(27ms);  // to 42 ms
    serve("topic", Serving::usual);
    serve("timer", Serving::usual);
    publish(4);
    clock_.advance(10ms);
    timer->cancel();
  }
  EXPECT_EQ(received, 6);
  EXPECT_EQ(ticks, 2);  // of 10 and 50 ms
  const CallbackStatistics topic = find(*executor, "topic"), released = find(*executor, "timer");
  EXPECT_EQ(topic.received, 6u);
  EXPECT_EQ(topic.dropped_by_mode, 3u);
  EXPECT_EQ(topic.expected, 9u);
  EXPECT_EQ(topic.lost() + topic.dropped, 0u);
  EXPECT_EQ(released.received, 2u);
  EXPECT_EQ(released.dropped_by_mode, 3u);
  EXPECT_EQ(released.expected, 5u);
  EXPECT_EQ(released.skipped, 0u);
}

// The watchdog reported what waited to be discarded.
TEST_P(ConformanceServing, WhatIsDroppedMissesNoDeadline) {
  const auto watchdog =
      std::make_shared<Watchdog>(ThreadAttributes{.name = "watchdog"}, Realtime::off, clock_);
  int misses = 0;
  const auto busy = node_->create_timer("busy", 10ms, [&] { clock_.work(9ms); });
  const auto publisher = node_->create_publisher<Number>("topic", 5);
  const auto subscription = node_->create_subscription<Number>("topic", 5, [](const Number&) {});
  subscription->set_parameters(
      {.deadline = 2ms, .on_deadline_miss = [&](const OverrunReport&) { ++misses; }});
  auto executor = made(watchdog);
  {
    const ManualSpin spin(*executor, clock_, participants() + 1);
    clock_.advance(11ms);
    publisher->publish(Number{});
    serve("topic", Serving::dropped);
    clock_.advance(20ms);
    busy->cancel();
  }
  EXPECT_EQ(misses, 0);
  EXPECT_EQ(find(*executor, "topic").dropped_by_mode, 1u);
  executor.reset();
}

TEST_P(ConformanceServing, ADemotedCallbackIsServedAfterAllOthersUntilItIsNot) {
  std::vector<std::string> trace;
  const auto timer = [&](const char* name, CallbackParameters parameters) {
    auto made = node_->create_timer(name, 10ms, [&trace, name] { trace.emplace_back(name); });
    made->set_parameters(parameters);
    return made;
  };
  const auto urgent = timer("urgent", {.priority = 10, .deadline = 1ms, .criticality = 10});
  const auto modest = timer("modest", {.priority = 1, .deadline = 5ms, .criticality = 1});
  const auto executor = made();
  const ManualSpin spin(*executor, clock_, participants());
  serve("urgent", Serving::demoted);
  clock_.advance(15ms);
  serve("urgent", Serving::usual);
  clock_.advance(10ms);
  if (heeds_demotion(scheduler_name()) && scheduler_name() != "chain_edf" && !is_pool()) {
    EXPECT_THAT(trace, ElementsAre("modest", "urgent", "urgent", "modest"));
  } else {
    EXPECT_EQ(trace.size(), 4u);  // whose order goes by no urgency, or by that of chains only
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceServing);

}  // namespace
}  // namespace takt::conformance
