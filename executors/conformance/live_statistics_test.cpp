// The statistics of an executor are read while it spins, and while callbacks come and go. Under the
// thread sanitizer this shows that no reader disturbs a worker.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

class ConformanceLiveStatistics : public Conformance {
 protected:
  ConformanceLiveStatistics() {
    const auto timer = node_->create_timer("timer", 100us, [this] { ++callbacks_; });
    const auto again = node_->create_publisher<Number>("again", 10, {.expected_period = 1us});
    const auto loop = node_->create_subscription<Number>(
        "again", 10,
        [this, again](const Number& number) {
          ++callbacks_;
          again->publish(number);
        },
        node_->create_callback_group("loop", CallbackGroupType::Reentrant));
    for (Entity* each : std::initializer_list<Entity*>{timer.get(), loop.get()}) {
      each->set_parameters({.deadline = 1us, .budget = 1us});
    }
    chain_ = Chain::create({.name = "chain", .deadline = 1us}, {{node_, "timer"}});
    kept_ = {timer, again, loop};
    executor_->add_node(node_);
    again->publish(Number{});
  }

  static void expect_whole(const Histogram& times) {
    std::uint64_t held = 0;
    const auto look = [&](std::size_t, Nanoseconds limit, std::uint64_t count) {
      held += count;
      EXPECT_GE(limit, times.min());
    };
    times.for_each_bucket(look);
    EXPECT_LE(held, times.count());
    EXPECT_LE(times.min(), times.max());
    EXPECT_LE(times.percentile(0.5), times.max());
  }

  std::atomic<std::uint64_t> callbacks_{0};
  const std::unique_ptr<Executor> executor_ = make(Clock::steady());
  const std::shared_ptr<Node> node_ = make_node(Clock::steady());
  std::shared_ptr<Chain> chain_;
  std::vector<std::shared_ptr<void>> kept_;
};

std::uint64_t received(const std::vector<CallbackStatistics>& rows) {
  std::uint64_t sum = 0;
  for (const CallbackStatistics& row : rows) sum += row.received;
  return sum;
}

TEST_P(ConformanceLiveStatistics, WhatIsReadIsTrueAndNeverAheadOfTheNext) {
  SpinThread spin(*executor_);
  std::vector<CallbackStatistics> last = executor_->statistics();
  ChainStatistics last_of_chain = chain_->statistics();
  int advances = 0;
  const auto look = [&] {
    const std::vector<CallbackStatistics> now = executor_->statistics();
    const std::uint64_t at_most = callbacks_.load() + 8;  // those that run
    EXPECT_LE(received(now), at_most);
    EXPECT_EQ(now.size(), last.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      EXPECT_EQ(now[i].callback, last[i].callback);
      EXPECT_GE(now[i].received, last[i].received);
      EXPECT_GE(now[i].execution.count() + 1, now[i].received);
      EXPECT_GE(now[i].deadline_misses, last[i].deadline_misses);
      expect_whole(now[i].latency);
      expect_whole(now[i].execution);
    }
    const ChainStatistics of_chain = chain_->statistics();
    EXPECT_GE(of_chain.instances, last_of_chain.instances);
    expect_whole(of_chain.latency);
    advances += received(now) > received(last) && of_chain.instances > last_of_chain.instances;
    last = now;
    last_of_chain = of_chain;
    return advances >= 3 || ::testing::Test::HasFailure();
  };
  EXPECT_TRUE(eventually(look));
  spin.stop();
  const std::vector<CallbackStatistics> end = executor_->statistics();
  EXPECT_EQ(received(end), callbacks_.load());
  for (const CallbackStatistics& row : end) EXPECT_EQ(row.execution.count(), row.received);
}

TEST_P(ConformanceLiveStatistics, CallbacksMayComeAndGoMeanwhile) {
  if (is_frozen()) GTEST_SKIP() << "nothing is added after its first spin";
  SpinThread spin(*executor_);
  std::atomic<bool> ends{false};
  std::uint64_t last = 0;
  std::thread reader([&] {
    while (!ends.load()) {  // the test ends it
      const std::uint64_t now = received(executor_->statistics());
      EXPECT_GE(now, last);
      last = now;
    }
  });
  for (int round = 0; round < 3; ++round) {
    const auto guest = make_node(Clock::steady(), "guest");
    const auto timer = guest->create_timer("timer", 50us, [this] { ++callbacks_; });
    executor_->add_node(guest);
    const std::uint64_t before = callbacks_.load();
    EXPECT_TRUE(eventually([&] { return callbacks_.load() > before + 3; }));
    executor_->remove_node(guest);
  }
  ends.store(true);
  reader.join();
  spin.stop();
  EXPECT_EQ(received(executor_->statistics()), callbacks_.load());
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceLiveStatistics);

}  // namespace
}  // namespace takt::conformance
