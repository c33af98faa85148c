// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/cyclic.hpp"

#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/clock.hpp"

namespace takt::rt {
namespace {

using namespace std::chrono_literals;

/// Records one latency after the other, without any wait, until it is stopped or has recorded all.
class Fake final : public CyclicVariant {
 public:
  Fake(Nanoseconds interval, Nanoseconds latency)
      : CyclicVariant({.interval = interval, .break_above = 100us}, "fake"), latency_(latency) {}
  std::uint64_t asked = 0;

 private:
  void run(std::uint64_t cycles, const std::atomic<bool>& stop) override {
    asked = cycles;
    for (std::uint64_t cycle = 0; cycle < cycles && !stop.load(); ++cycle) {
      if (latency_ < Nanoseconds::zero()) throw std::runtime_error("refused");
      if (!record(latency_, Clock::steady().now())) return;
      std::this_thread::yield();
    }
  }
  const Nanoseconds latency_;
};

class Cyclic : public testing::Test {
 protected:
  const Fake& add(Nanoseconds interval, Nanoseconds latency) {
    auto fake = std::make_unique<Fake>(interval, latency);
    const Fake& added = *fake;
    rows_.push_back(std::move(fake));
    return added;
  }

  std::vector<std::unique_ptr<CyclicVariant>> rows_;
  std::atomic<bool> stop_{false};
};

TEST_F(Cyclic, AThreadThatBreaksStopsTheOthers) {
  constexpr std::uint64_t kForEver = UINT64_MAX;
  const Fake& quick = add(1ms, 1us);
  const Fake& late = add(1ms, 200us);
  run_together(rows_, kForEver, CyclesOf::each, stop_);  // with a thread that goes on, a hang
  EXPECT_TRUE(late.result().broke);
  EXPECT_FALSE(quick.result().broke);
  EXPECT_EQ(late.result().cycles, 1u);
  EXPECT_TRUE(stop_.load());
}

// Its thread is new and its caches are cold, in each round: what was latest was often the first
// cycle. The executor's threads went on after the last one, and counted.
TEST_F(Cyclic, TheFirstCycleOfARoundAndThoseAfterItsEndDoNotCount) {
  const CyclicOptions options{.interval = 200us, .bins = 10};
  rows_.push_back(bare_loop(options));
  rows_.push_back(executor_timer(options, "isolated"));
  run_together(rows_, 5, CyclesOf::each, stop_);
  run_together(rows_, 5, CyclesOf::each, stop_);
  for (const auto& row : rows_) EXPECT_EQ(row->result().cycles, 10u) << row->result().name;
  EXPECT_GE(rows_[0]->result().wall_time, 12 * 200us);
}

TEST_F(Cyclic, ByTimeALongerIntervalHasFewerCycles) {
  const Fake& first = add(1ms, 1us);
  const Fake& second = add(1500us, 1us);
  const Fake& slow = add(10s, 1us);
  run_together(rows_, 300, CyclesOf::first, stop_);
  EXPECT_EQ(first.asked, 300u);
  EXPECT_EQ(second.asked, 200u);
  EXPECT_EQ(slow.asked, 1u);
  run_together(rows_, 300, CyclesOf::each, stop_);
  EXPECT_EQ(second.asked, 300u);
}

TEST_F(Cyclic, AnErrorOfOneThreadStopsTheOthersAndIsThrown) {
  add(1ms, 1us);
  add(1ms, -1us);
  EXPECT_THROW(run_together(rows_, UINT64_MAX, CyclesOf::each, stop_), std::runtime_error);
}

}  // namespace
}  // namespace takt::rt
