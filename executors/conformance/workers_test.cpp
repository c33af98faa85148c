// What several workers promise: a callback that is ready and admitted waits for no busy worker
// while another is free, and none is lost while workers take turns, search and sleep.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <semaphore>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceWorkers : public Conformance {
 protected:
  void SetUp() override {
    if (most_workers() == 1 || is_isolated()) GTEST_SKIP() << "it has one worker";
  }
  std::unique_ptr<Executor> make_with(std::size_t workers, Nanoseconds spin = 0ns) const {
    ExecutorOptions options;
    options.spin = spin;
    options.scheduler = scheduler_name();
    options.statistics = StatisticsLevel::count;
    options.threads.resize(workers);
    return make(options);
  }
  std::shared_ptr<CallbackGroup> make_group(const std::string& name) const {
    return node_->create_callback_group(name, CallbackGroupType::MutuallyExclusive);
  }
  /// `brief_` triggers itself as often as the round asks for, then `busy_`, which calls `begin` and
  /// is at work until `may_end`.
  void make_callbacks(const std::function<void()>& begin, const std::function<bool()>& may_end) {
    busy_ = node_->create_guard_condition(
        "busy",
        [this, begin, may_end] {
          begin();
          const TimePoint limit = Clock::steady().now() + 30s;
          while (!may_end() && Clock::steady().now() < limit) {
          }
          EXPECT_TRUE(may_end()) << "round " << rounds_;
          ++rounds_;
        },
        make_group("busy"));
    brief_ = node_->create_guard_condition(
        "brief", [this] { (shorts_left_-- > 0 ? brief_ : busy_)->trigger(); }, make_group("brief"));
  }
  void begin_round(int shorts) {
    shorts_left_ = shorts;
    brief_->trigger();
  }
  testing::AssertionResult round_ends(int round) const {
    if (eventually([&] { return rounds_ == round + 1; })) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "round " << round << " has not ended";
  }

  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node");

 private:
  std::shared_ptr<GuardCondition> brief_, busy_;
  int shorts_left_ = 0;
  std::atomic<int> rounds_{0};
};

/// A guard condition that is taken for as long as the test wants, as one that decodes a message.
class SlowGuard final : public GuardCondition {
 public:
  using GuardCondition::GuardCondition;
  std::atomic<bool> is_being_taken{false}, may_be_taken{false}, was_taken_in_time{false};
  bool take(Slot& slot) noexcept override {
    is_being_taken = true;
    was_taken_in_time = eventually([this] { return may_be_taken.load(); });
    return GuardCondition::take(slot);
  }
  bool takes_briefly() const noexcept override { return false; }
};

/// A timer that is taken for a while, the first time: for so long that the other worker begins to
/// spin meanwhile. If it does not, the test passes without having seen anything.
class SlowTimer final : public Timer {
 public:
  using Timer::Timer;
  std::atomic<bool> is_being_taken{false}, ends{false};
  bool take(Slot& slot) noexcept override {
    if (!is_being_taken.exchange(true)) {
      EXPECT_TRUE(eventually([this] { return ends.load(); }));
      const TimePoint end = Clock::steady().now() + 200us;
      while (Clock::steady().now() < end) {
      }
    }
    return Timer::take(slot);
  }
};

class NodeOfSlow final : public Node {
 public:
  using Node::Node;
  std::shared_ptr<SlowTimer> make_timer(const std::shared_ptr<CallbackGroup>& group,
                                        std::function<void()> callback) {
    return adopt<SlowTimer>(
        std::make_shared<SlowTimer>("timer", group, clock().real(), 5ms, std::move(callback)));
  }
  std::shared_ptr<SlowGuard> make(const std::shared_ptr<CallbackGroup>& group) {
    return adopt<SlowGuard>(std::make_shared<SlowGuard>("slow", group, clock().real(), [] {}));
  }
};

TEST_P(ConformanceWorkers, WhatOneWorkerTakesHoldsUpNoOther) {
  for (const auto type : {CallbackGroupType::MutuallyExclusive, CallbackGroupType::Reentrant}) {
    const auto executor = make_with(2);
    const auto node = std::make_shared<NodeOfSlow>("slow");
    const auto slow = node->make(node->create_callback_group("slow", type));
    const auto other = node->create_guard_condition(
        "other", [&] { slow->may_be_taken = true; },
        node->create_callback_group("other", CallbackGroupType::MutuallyExclusive));
    executor->add_node(node);
    SpinThread spin(*executor);
    slow->trigger();
    ASSERT_TRUE(eventually([&] { return slow->is_being_taken.load(); }));
    other->trigger();
    ASSERT_TRUE(eventually([&] { return slow->may_be_taken.load(); }));
    ASSERT_TRUE(eventually([&] { return slow->was_taken_in_time.load(); }));
  }
}

// The busy callback lasts until the one for which it is the only obstacle has run. Short callbacks
// before it differ in what the other worker does meanwhile: after none it sleeps, after many it
// searches.
TEST_P(ConformanceWorkers, AReadyCallbackWaitsForNoBusyWorkerWhileAnotherIsFree) {
  constexpr int kRounds = 30;
  const auto executor = make_with(2);
  std::atomic<bool> has_run{false}, is_busy{false};
  bool triggers_itself = false;
  const auto other = node_->create_guard_condition(
      "other", [&] { has_run = true; }, make_group("other"));
  make_callbacks(
      [&] {
        if (triggers_itself) other->trigger();
        is_busy = true;
      },
      [&] { return has_run.load(); });
  executor->add_node(node_);
  SpinThread spin(*executor);
  for (int round = 0; round < kRounds; ++round) {
    has_run = is_busy = false;
    triggers_itself = round % 2 == 0;
    begin_round(std::array{0, 10, 1000}[static_cast<std::size_t>(round % 3)]);
    if (!triggers_itself) {
      ASSERT_TRUE(eventually([&] { return is_busy.load(); }));
      other->trigger();
    }
    ASSERT_TRUE(round_ends(round));
  }
}

TEST_P(ConformanceWorkers, ATimerWaitsForNoBusyWorkerWhileAnotherIsFree) {
  std::atomic<int> releases{0};
  int before = 0, rounds = 0;
  const auto timer = node_->create_timer(
      "timer", 1ms, [&] { ++releases; }, make_group("timer"));
  make_callbacks([&] { before = releases; }, [&] { return releases > before + 2; });
  for (const Nanoseconds spin_time : {0ns, Nanoseconds(50us), Nanoseconds(1ms)}) {
    if (spin_time != 0ns && traits_.workers != nullptr) break;
    const auto executor = make_with(2, spin_time);
    executor->add_node(node_);
    {
      SpinThread spin(*executor);
      for (int round = 0; round < 10; ++round) {
        begin_round(round % 2 == 0 ? 0 : 1000);
        ASSERT_TRUE(round_ends(rounds++));
      }
    }
    executor->remove_node(node_);
  }
}

// The worker that wakes up for the long timer is busy with it. Nobody wakes another one for that,
// which has to have its own time for the short one.
TEST_P(ConformanceWorkers, AWorkerThatTimersWakeLeavesTheNextOneToAnother) {
  std::atomic<int> releases{0}, rounds{0};
  std::atomic<bool> ends{false};
  const auto brief = node_->create_timer(
      "brief", 5ms, [&] { ++releases; }, make_group("brief"));
  const auto busy = node_->create_timer(
      "busy", 20ms,
      [&] {
        const int before = releases;
        EXPECT_TRUE(eventually([&] { return releases >= before + 10 || ends; }));
        ++rounds;
      },
      make_group("busy"));
  const auto executor = make_with(2);
  executor->add_node(node_);
  SpinThread spin(*executor);
  EXPECT_TRUE(eventually([&] { return rounds >= 2; }));
  ends = true;
}

// While the timer is taken there is no release, and the other worker begins to spin without one.
// Then the timer is armed again, and its callback waits for the next one of its group.
TEST_P(ConformanceWorkers, AWorkerThatSpinsLearnsOfATimerThatIsArmedMeanwhile) {
  if (traits_.workers != nullptr) GTEST_SKIP() << kNoSpin;
  for (int round = 0; round < 3; ++round) {
    const auto executor = make_with(2, 1ms);
    const auto node = std::make_shared<NodeOfSlow>("slow");
    std::atomic<int> begun{0};
    std::atomic<bool> is_in_time{false};
    const auto timer =
        node->make_timer(node->create_callback_group("timer", CallbackGroupType::Reentrant), [&] {
          if (++begun == 1) is_in_time = eventually([&] { return begun > 1; });
        });
    const auto other = node->create_guard_condition(
        "other", [&] { timer->ends = true; },
        node->create_callback_group("other", CallbackGroupType::MutuallyExclusive));
    executor->add_node(node);
    SpinThread spin(*executor);
    ASSERT_TRUE(eventually([&] { return timer->is_being_taken.load(); }));
    other->trigger();
    ASSERT_TRUE(eventually([&] { return is_in_time.load(); }));
  }
}

// A worker that dispatches so fast that the other only watched it kept it from a callback for ever,
// where the scheduler's order does. The test's own thread sleeps: each time it ran, it would slow
// the fast one down, and the other would come. On a machine that preempts often, that happens
// without the test's help: there it has seen little.
TEST_P(ConformanceWorkers, AFastCallbackOfMorePriorityStarvesNoneWhileAnotherWorkerIsFree) {
  constexpr int kRounds = 10, kRunsOfARound = 20'000;
  const auto urgent = make_group("urgent");
  urgent->set_parameters({.priority = 1});
  std::shared_ptr<GuardCondition> fast, slow;
  std::atomic<bool> is_waiting{false};
  std::binary_semaphore ends(0);
  int runs = 0, rounds = 0;
  fast = node_->create_guard_condition(
      "fast",
      [&] {
        if (++runs % kRunsOfARound == 0 && !is_waiting.exchange(true)) slow->trigger();
        fast->trigger();
      },
      urgent);
  slow = node_->create_guard_condition(
      "slow",
      [&] {
        if (++rounds == kRounds) ends.release();
        is_waiting = false;
      },
      make_group("slow"));
  const auto executor = make_with(2);
  executor->add_node(node_);
  SpinThread spin(*executor);
  fast->trigger();
  ASSERT_TRUE(ends.try_acquire_for(30s));
}

// Tokens travel around rings of topics, in groups of both kinds. One that got lost, or a worker
// that overslept, would be missing at the end; a group that two workers enter would show.
TEST_P(ConformanceWorkers, NoMessageIsLostWhileWorkersTakeTurns) {
  constexpr int kTopics = 6, kTokens = 4, kHops = 3000;
  for (const std::size_t workers : {2u, 3u}) {
    const auto node = std::make_shared<Node>("ring_" + std::to_string(workers));
    const auto executor = make_with(workers);
    std::vector<std::shared_ptr<Publisher<Number>>> publishers;
    std::vector<std::shared_ptr<void>> parts;
    std::array<std::atomic<int>, kTopics> inside{};
    std::atomic<int> ended{0};
    std::atomic<bool> is_exclusive{true};
    for (int i = 0; i < kTopics; ++i) {
      publishers.push_back(node->create_publisher<Number>("topic_" + std::to_string(i), kTokens));
    }
    for (int i = 0; i < kTopics; ++i) {
      const bool is_reentrant = i % 3 == 2;
      const auto group = node->create_callback_group(
          "group_" + std::to_string(i),
          is_reentrant ? CallbackGroupType::Reentrant : CallbackGroupType::MutuallyExclusive);
      parts.push_back(node->create_subscription<Number>(
          "topic_" + std::to_string(i), kTokens,
          [&, i, is_reentrant](const Number& token) {
            std::atomic<int>& here = inside[static_cast<std::size_t>(i)];
            if (here.fetch_add(1) != 0 && !is_reentrant) is_exclusive = false;
            // Now and then one that is not short.
            for (volatile int work = token.value % 64 == 0 ? 5000 : 0; work > 0;) work = work - 1;
            if (token.value == kHops) {
              ++ended;
            } else {
              publishers[static_cast<std::size_t>((i + 1) % kTopics)]->publish(
                  Number{token.value + 1});
            }
            here.fetch_sub(1);
          },
          group));
    }
    executor->add_node(node);
    SpinThread spin(*executor);
    for (int token = 0; token < kTokens; ++token) {
      publishers[static_cast<std::size_t>(token)]->publish(Number{token});
    }
    EXPECT_TRUE(eventually([&] { return ended == kTokens; })) << ended << " of " << kTokens;
    EXPECT_TRUE(is_exclusive);
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceWorkers);

}  // namespace
}  // namespace takt::conformance
