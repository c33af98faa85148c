// Every number of a row of the statistics, exactly: under a manual clock, with a subscription that
// takes long to take, as one does that decodes. Run for every executor under every scheduler.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

constexpr Nanoseconds kTake = 1ms, kWork = 7ms;

template <class F>
struct SlowToTake final : CallbackSubscription<Number, F> {
  SlowToTake(ManualClock& of_test, const std::string& name,
             const std::shared_ptr<CallbackGroup>& group, const Endpoint& endpoint, F callback)
      : CallbackSubscription<Number, F>(name, group, endpoint, std::move(callback)),
        clock(of_test) {}
  using CallbackSubscription<Number, F>::take;
  bool take(Slot& slot) noexcept override {
    clock.work(kTake);
    return CallbackSubscription<Number, F>::take(slot);
  }
  ManualClock& clock;
};

class SlowNode final : public Node {
 public:
  SlowNode(const std::string& name, ManualClock& clock)
      : Node(name, {.clock = &clock}), clock_(clock) {}
  template <class F>
  std::shared_ptr<Subscription<Number>> subscribe(const std::string& topic, F callback) {
    auto subscription = std::make_shared<SlowToTake<F>>(
        clock_, topic, group_or_default(nullptr), endpoint<Number>(topic, 10), std::move(callback));
    auto handle = adopt<Subscription<Number>>(subscription);
    subscription->start();
    return handle;
  }

 private:
  ManualClock& clock_;
};

/// Count, minimum, maximum and sum.
auto numbers(const Histogram& histogram) {
  return std::tuple(histogram.count(), histogram.min(), histogram.max(), histogram.sum());
}
auto numbers(std::initializer_list<Nanoseconds> samples) {
  Histogram histogram;
  for (const Nanoseconds sample : samples) histogram.record(sample);
  return numbers(histogram);
}

class ConformanceStatistics : public Conformance {
 protected:
  static CallbackStatistics row(const Executor& executor, const std::string& callback) {
    for (CallbackStatistics& row : executor.statistics()) {
      if (row.callback == callback) return row;
    }
    ADD_FAILURE() << "no row of " << callback;
    return {};
  }
  CallbackStatistics row(const std::string& callback) const { return row(*executor_, callback); }

  ManualClock clock_{TimePoint(1s), virtual_cpus()};
  const std::unique_ptr<Executor> executor_ = make(clock_, 1);
  const std::shared_ptr<SlowNode> node_ = std::make_shared<SlowNode>("node", clock_);
};

TEST_P(ConformanceStatistics, LatencyIsTheWaitAndTheTake) {
  const auto publisher = node_->create_publisher<Number>("topic", 10, {.expected_period = 10ms});
  const auto subscription = node_->subscribe("topic", [&](const Number&) { clock_.work(kWork); });
  executor_->add_node(node_);
  executor_->spin_some();
  publisher->publish(Number{1});
  clock_.work(3ms);
  publisher->publish(Number{2});
  executor_->spin_all();
  publisher->publish(Number{3});
  clock_.work(10ms);
  executor_->spin_all();
  const CallbackStatistics measured = row("topic");
  EXPECT_EQ(numbers(measured.waiting), numbers({3ms, kTake + kWork, 10ms}));
  EXPECT_EQ(numbers(measured.take), numbers({kTake, kTake, kTake}));
  EXPECT_EQ(numbers(measured.latency), numbers({4ms, 9ms, 11ms}));
  EXPECT_EQ(numbers(measured.execution), numbers({kWork, kWork, kWork}));
  EXPECT_EQ(measured.received, 3u);
  EXPECT_EQ(measured.expected, 3u);
  EXPECT_EQ(measured.dropped, 0u);
  EXPECT_EQ(measured.late, 2u);      // more than a fifth of the period
  EXPECT_EQ(measured.too_late, 1u);  // more than the period
}

TEST_P(ConformanceStatistics, AllocationsAreThoseOfTheCallback) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto publisher = node_->create_publisher<Number>("topic", 10);
  std::shared_ptr<int> kept;
  const auto allocates = node_->create_subscription<Number>("topic", 10, [&](const Number&) {
    kept = nullptr;
    kept = std::make_shared<int>();
  });
  const auto other = node_->create_subscription<Number>("/topic", 10, [](const Number&) {});
  executor_->add_node(node_);
  executor_->spin_some();
  for (int i = 0; i < 3; ++i) {
    publisher->publish(std::make_unique<Number>());  // outside of callbacks
    executor_->spin_all();
  }
  EXPECT_EQ(row("topic").allocations, 3u);
  EXPECT_EQ(row("/topic").allocations, 0u);
}

// An executor that runs little of what is due looked better than one that runs all: releases that
// were never served were in no count.
TEST_P(ConformanceStatistics, ReleasesThatAreNotServedAreSkipped) {
  const auto timer = node_->create_timer("timer", 100ms, [] {});
  executor_->add_node(node_);
  executor_->spin_some();
  clock_.work(350ms);  // due at 100, 200 and 300
  executor_->spin_all();
  EXPECT_EQ(row("timer").received, 1u);
  EXPECT_EQ(row("timer").skipped, 2u);
  clock_.work(200ms);  // at 400 and 500, too
  executor_->release_timers(false);
  clock_.work(200ms);
  EXPECT_EQ(row("timer").received, 1u);
  EXPECT_EQ(row("timer").skipped, 4u);
  EXPECT_EQ(row("timer").overruns, 4u);
}

// Recording all but one sample of a hundred passed all tests.
TEST_P(ConformanceStatistics, EveryExecutionIsRecorded) {
  constexpr std::uint64_t kMessages = 210;
  const auto publisher = node_->create_publisher<Number>("topic", 10, {.expected_period = 10ms});
  const auto subscription = node_->subscribe("topic", [&](const Number&) { clock_.work(kWork); });
  executor_->add_node(node_);
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    executor_->spin_some();
    publisher->publish(Number{});
    executor_->spin_some();
  }
  const CallbackStatistics measured = row("topic");
  EXPECT_EQ(measured.received, kMessages);
  EXPECT_EQ(measured.latency.count(), kMessages);
  EXPECT_EQ(measured.waiting.count(), kMessages);
  EXPECT_EQ(measured.take.count(), kMessages);
  EXPECT_EQ(measured.execution.count(), kMessages);
  EXPECT_EQ(measured.execution.sum(), kMessages * kWork);
}

// Counting a miss only where the deadline was exceeded by a tenth passed all tests.
TEST_P(ConformanceStatistics, AnythingBeyondALimitCounts) {
  Nanoseconds work = 9ms;
  const auto publisher = node_->create_publisher<Number>("topic", 10, {.expected_period = 20ms});
  const auto timer = node_->create_timer("timer", 100ms, [&] { publisher->publish(Number{}); });
  const auto subscription = node_->subscribe("topic", [&](const Number&) { clock_.work(work); });
  subscription->set_parameters({.deadline = kTake + 9ms, .budget = 9ms});
  const auto chain = Chain::create({.name = "chain", .deadline = kTake + 9ms},
                                   {{node_, "timer"}, {node_, "topic"}});
  executor_->add_node(node_);
  executor_->spin_some();
  const auto misses = [&] {
    clock_.work(timer->due() - clock_.now());
    executor_->spin_all();
    return std::tuple(row("topic").deadline_misses, row("topic").overruns,
                      chain->statistics().misses);
  };
  EXPECT_EQ(misses(), std::tuple(0, 0, 0));
  work += 1ns;
  EXPECT_EQ(misses(), std::tuple(1, 1, 1));
  const auto late = [&](Nanoseconds wait) {
    const CallbackStatistics before = row("topic");
    publisher->publish(Number{});
    clock_.work(wait - kTake);
    executor_->spin_all();
    const CallbackStatistics now = row("topic");
    return std::tuple(*now.late - before.late.value_or(0),
                      *now.too_late - before.too_late.value_or(0));
  };
  EXPECT_EQ(late(4ms), std::tuple(0, 0));  // a fifth of the period
  EXPECT_EQ(late(4ms + 1ns), std::tuple(1, 0));
  EXPECT_EQ(late(20ms), std::tuple(1, 0));
  EXPECT_EQ(late(20ms + 1ns), std::tuple(0, 1));
}

TEST_P(ConformanceStatistics, AChainIsMeasuredFromItsReleaseToItsEnd) {
  const auto publisher = node_->create_publisher<Number>("topic", 10);
  const auto timer = node_->create_timer("timer", 100ms, [&] {
    clock_.work(2ms);
    publisher->publish(Number{});
  });
  const auto subscription = node_->subscribe("topic", [&](const Number&) { clock_.work(kWork); });
  const auto chain =
      Chain::create({.name = "chain", .deadline = 12ms}, {{node_, "timer"}, {node_, "topic"}});
  executor_->add_node(node_);
  executor_->spin_some();
  clock_.work(103ms);  // the timer is due at 100
  executor_->spin_all();
  const CallbackStatistics released = row("timer");
  EXPECT_EQ(numbers(released.waiting), numbers({}));  // parts of a message's latency
  EXPECT_EQ(numbers(released.take), numbers({}));
  EXPECT_EQ(numbers(released.latency), numbers({3ms}));
  EXPECT_EQ(numbers(released.execution), numbers({2ms}));
  const CallbackStatistics received = row("topic");
  EXPECT_EQ(numbers(received.latency), numbers({kTake}));
  EXPECT_EQ(received.late, std::nullopt);  // its publisher names none
  const ChainStatistics measured = chain->statistics();
  EXPECT_EQ(numbers(measured.latency), numbers({3ms + 2ms + kTake + kWork}));
  EXPECT_EQ(measured.instances, 1u);
  EXPECT_EQ(measured.misses, 1u);
  EXPECT_EQ(measured.aborted, 0u);
}

TEST_P(ConformanceStatistics, ExecutionIsTheCallbackAndNotTheHandlerOfItsLimits) {
  const auto group = node_->create_callback_group("limited", CallbackGroupType::MutuallyExclusive);
  CallbackParameters parameters;
  parameters.deadline = 1ms;
  parameters.on_deadline_miss = [&](const OverrunReport&) { clock_.work(5ms); };
  node_->set_callback_parameters({.callback_groups = {{"limited", parameters}}, .callbacks = {}});
  const auto timer = node_->create_timer(
      "timer", 10ms, [&] { clock_.work(2ms); }, group);
  executor_->add_node(node_);
  executor_->spin_some();
  clock_.work(10ms);
  executor_->spin_some();
  const CallbackStatistics measured = row("timer");
  EXPECT_EQ(numbers(measured.execution), numbers({2ms}));
  EXPECT_EQ(measured.deadline_misses, 1u);
}

// What the entity had counted since it was made was counted again by each executor that got it: a
// node that was removed and added again seemed to have lost its earlier messages.
TEST_P(ConformanceStatistics, AnExecutorAnswersForWhatCameSinceItHasTheCallback) {
  const auto publisher = node_->create_publisher<Number>("topic", 20);
  const auto subscription = node_->subscribe("topic", [](const Number&) {});
  const auto timer = node_->create_timer("timer", 100ms, [] {});
  const auto publish = [&](int messages) {
    for (int i = 0; i < messages; ++i) publisher->publish(Number{});
  };
  const auto counts = [](const CallbackStatistics& of) {
    return std::tuple(of.expected, of.received, of.dropped, of.skipped);
  };
  std::unique_ptr<Executor> first = make(clock_, 1);
  publish(1);
  first->add_node(node_);
  first->spin_all();
  publish(2);
  clock_.work(350ms);  // due at 100, 200 and 300
  first->spin_all();
  publish(2);
  first->release_timers(false);
  EXPECT_EQ(counts(row(*first, "topic")), std::tuple(5, 3, 0, 0));
  EXPECT_EQ(counts(row(*first, "timer")), std::tuple(1, 1, 0, 2));
  first.reset();
  publish(12);  // with the two that wait, four more than its depth
  executor_->add_node(node_);
  executor_->spin_all();
  EXPECT_EQ(counts(row("topic")), std::tuple(14, 10, 4, 0));
  EXPECT_EQ(counts(row("timer")), std::tuple(0, 0, 0, 0));
  if (is_frozen()) return;
  publish(1);
  executor_->remove_node(node_);
  EXPECT_EQ(counts(row("topic")), std::tuple(14, 10, 4, 0));
  executor_->add_node(node_);
  executor_->spin_all();
  EXPECT_EQ(counts(row("topic")), std::tuple(15, 11, 4, 0));
}

TEST_P(ConformanceStatistics, CountMeasuresNoTimesAndOffNothing) {
  for (const StatisticsLevel level : {StatisticsLevel::count, StatisticsLevel::off}) {
    ExecutorOptions options;
    options.scheduler = scheduler_name();
    options.clock = &clock_;
    options.statistics = level;
    const auto executor = make(options);
    const auto node = std::make_shared<SlowNode>("counted", clock_);
    const auto publisher = node->create_publisher<Number>("counted", 10);
    const auto subscription = node->subscribe("counted", [](const Number&) {});
    executor->add_node(node);
    publisher->publish(Number{});
    executor->spin_all();
    const CallbackStatistics measured = executor->statistics().at(0);
    EXPECT_EQ(measured.received, level == StatisticsLevel::count ? 1u : 0u);
    for (const Histogram* times :
         {&measured.latency, &measured.waiting, &measured.take, &measured.execution}) {
      EXPECT_EQ(times->count(), 0u);
    }
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceStatistics);

}  // namespace
}  // namespace takt::conformance
