// Executors that wait without sleeping: `spin` and `early_wake`. Run for every executor under every
// scheduler.
// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceSpinning : public Conformance {
 public:
  void SetUp() override {
    if (traits_.workers != nullptr) GTEST_SKIP() << kNoSpin;
  }
  /// Never asleep where a CPU is left to the test, else asleep only after a long time.
  std::unique_ptr<Executor> make_spinning(Clock& clock = Clock::steady()) const {
    ExecutorOptions options;
    options.scheduler = scheduler_name();
    options.clock = &clock;
    const bool has_own_cpu = available_cpus().size() > 1 && !is_pool();
    options.spin = has_own_cpu ? kSpinAlways : kMostSpin;
    if (is_pool()) options.threads.resize(workers());
    return make(options);
  }
};

// A timer that wakes early still waits for its release, and what arrives meanwhile waits for
// nobody.
TEST_P(ConformanceSpinning, WhoWakesEarlyRunsNothingEarly) {
  ExecutorOptions options;
  options.scheduler = scheduler_name();
  options.early_wake = 500us;
  const auto executor = make(options);
  const auto node = make_node(Clock::steady());
  std::atomic<int> releases{0}, early{0}, triggers{0};
  const auto timer = node->create_timer("timer", 1ms, [&] {
    if (Clock::steady().now() < Dispatch::current()->root_release) ++early;
    ++releases;
  });
  const auto guard = node->create_guard_condition("guard", [&] { ++triggers; });
  executor->add_node(node);
  SpinThread spin(*executor);
  for (int round = 1; round <= 20; ++round) {
    const int before = releases;
    guard->trigger();
    ASSERT_TRUE(eventually([&] { return triggers == round && releases > before; }));
  }
  EXPECT_EQ(early, 0);
}

TEST_P(ConformanceSpinning, AWorkerThatSpinsSeesAllThatWouldWakeASleeper) {
  const auto executor = make_spinning();
  const auto node = make_node(Clock::steady());
  std::atomic<int> triggers{0}, releases{0}, reads{0}, late{0};
  const auto guard = node->create_guard_condition("guard", [&] { ++triggers; });
  const auto timer = node->create_timer("timer", 1ms, [&] { ++releases; });
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  auto pipe_end = node->create_file_descriptor("pipe", ends[0], FileDescriptorEvents::readable,
                                               [&](FileDescriptorEvents) {
                                                 char byte;
                                                 if (read(ends[0], &byte, 1) == 1) ++reads;
                                               });
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return executor->is_spinning() && releases > 2; }));
  executor->release_timers(false);
  for (int round = 1; round <= 5; ++round) {
    guard->trigger();
    ASSERT_TRUE(eventually([&] { return triggers == round; }));
    ASSERT_EQ(write(ends[1], "x", 1), 1);
    ASSERT_TRUE(eventually([&] { return reads == round; }));
    const int held = releases;
    executor->release_timers(true);
    ASSERT_TRUE(eventually([&] { return releases > held; }));
    executor->release_timers(false);
  }
  if (!is_frozen()) {
    const auto added = node->create_guard_condition("added", [&] { ++late; });
    added->trigger();
    ASSERT_TRUE(eventually([&] { return late == 1; }));
  }
  spin.stop();
  pipe_end.reset();
  close(ends[0]);
  close(ends[1]);
}

TEST_P(ConformanceSpinning, AnExceptionEndsAPoolThatSpins) {
  const auto executor = make_spinning();
  const auto node = make_node(Clock::steady());
  const auto guard = node->create_guard_condition("guard", [] { throw std::runtime_error("no"); });
  executor->add_node(node);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return executor->is_spinning(); }));
  guard->trigger();
  spin.join();
  EXPECT_NE(spin.exception, nullptr);
}

TEST_P(ConformanceSpinning, AWorkerThatSpinsIsNotWokenAndSaysWhatItCosts) {
  const auto executor = make_spinning();
  const auto node = make_node(Clock::steady());
  constexpr int kRounds = 200;
  std::atomic<int> triggers{0};
  const auto guard = node->create_guard_condition("guard", [&] { ++triggers; });
  executor->add_node(node);
  SpinThread spin(*executor);
  for (int round = 1; round <= kRounds; ++round) {
    guard->trigger();
    ASSERT_TRUE(eventually([&] { return triggers == round; }));
  }
  spin.stop();
  std::uint64_t sleeps = 0;
  Nanoseconds spun{0}, used{0};
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    sleeps += thread.counters.voluntary_switches;
    spun += thread.spin_time;
    used += thread.cpu_time;
    EXPECT_EQ(thread.counters.allocations, 0u) << thread.asked.name;
  }
  EXPECT_GT(spun, 0ns);
  EXPECT_LE(spun, used);
  if (available_cpus().size() > 1 && !is_pool()) {
    EXPECT_LT(sleeps, kRounds / 4u);
  }
}

TEST_P(ConformanceSpinning, UnderAManualClockItTakesNoTime) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make_spinning(clock);
  const auto node = make_node(clock);
  std::vector<int> starts_ms;
  const auto timer = node->create_timer("timer", 10ms, [&] {
    starts_ms.push_back(static_cast<int>(clock.now().time_since_epoch() / 1ms));
  });
  executor->add_node(node);
  const ManualSpin spin(*executor, clock, participants());
  clock.advance(35ms);
  EXPECT_THAT(starts_ms, ElementsAre(10, 20, 30));
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceSpinning);

}  // namespace
}  // namespace takt::conformance
