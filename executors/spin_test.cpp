// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/spin.hpp"

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <gtest/gtest.h>
#include <sys/prctl.h>

namespace takt {
namespace {

using namespace std::chrono_literals;

class CancelOnSignalsTest : public testing::TestWithParam<int> {};

TEST_P(CancelOnSignalsTest, ASignalEndsTheSpinOfEachExecutor) {
  const auto events = executors().make("events", {});
  const auto pool = executors().make("multi_threaded", {});
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard", [] { std::raise(GetParam()); });
  events->add_node(node);
  const auto first = cancel_on_signals(*events);
  const auto second = cancel_on_signals(*pool);
  std::jthread other([&] { pool->spin(); });
  guard->trigger();
  events->spin();
}

TEST_P(CancelOnSignalsTest, ASignalBeforeTheSpinEndsItToo) {
  const auto executor = executors().make("events", {});
  const auto signals = cancel_on_signals(*executor);
  std::raise(GetParam());
  executor->spin();
}

TEST_P(CancelOnSignalsTest, SpinOfANodeEnds) {
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard", [] { std::raise(GetParam()); });
  guard->trigger();
  spin(node);
  guard->trigger();
  spin(node);  // the node has left the first executor
}

TEST_P(CancelOnSignalsTest, ASecondSignalEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // there are threads
  EXPECT_EXIT(
      {
        const auto executor = executors().make("events", {});
        const auto signals = cancel_on_signals(*executor);
        std::raise(GetParam());
        std::this_thread::sleep_for(550ms);
        std::raise(GetParam());
      },
      testing::KilledBySignal(GetParam()), "");
}

// A launcher sends SIGINT, then SIGTERM to what hangs: SIGTERM only canceled once more.
TEST_P(CancelOnSignalsTest, AnotherSignalEndsTheProcessAtOnce) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const int other = GetParam() == SIGINT ? SIGTERM : SIGINT;
  EXPECT_EXIT(
      {
        const auto executor = executors().make("events", {});
        const auto signals = cancel_on_signals(*executor);
        std::raise(GetParam());
        std::raise(other);
      },
      testing::KilledBySignal(other), "");
}

// `timeout -s INT` sends the signal to the process and to its group: the second one ended programs
// before they had written their recordings.
TEST_P(CancelOnSignalsTest, TheSameSignalTwiceAtOnceIsOne) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        {
          const auto executor = executors().make("events", {});
          const auto signals = cancel_on_signals(*executor);
          std::raise(GetParam());
          std::raise(GetParam());
          executor->spin();
        }
        std::raise(GetParam());
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "");
}

TEST_P(CancelOnSignalsTest, SignalsDoAgainWhatTheyDidBefore) {
  static int caught = 0;
  caught = 0;
  const auto before = std::signal(GetParam(), [](int) { ++caught; });
  {
    const auto executor = executors().make("events", {});
    const auto signals = cancel_on_signals(*executor);
    std::raise(GetParam());
    executor->spin();
  }
  EXPECT_EQ(caught, 0);
  std::raise(GetParam());
  EXPECT_EQ(caught, 1);
  std::signal(GetParam(), before);
}

INSTANTIATE_TEST_SUITE_P(Signals, CancelOnSignalsTest, testing::Values(SIGINT, SIGTERM),
                         [](const auto& signal) {
                           return signal.param == SIGINT ? "SIGINT" : "SIGTERM";
                         });

// SCHED_OTHER threads woke up 50 µs late for every timer.
TEST(SpinTest, ThreadsSleepWithoutTheKernelsSlack) {
  const auto slack_in_callback = [](const std::string& type, auto&& spin) {
    std::atomic<int> slack{-1};
    std::thread([&] {
      const auto executor = executors().make(type, {});
      const auto node = std::make_shared<Node>("node");
      int ticks = 0;
      const auto timer = node->create_timer("timer", 1ms, [&] {
        slack = prctl(PR_GET_TIMERSLACK);
        // On a busy machine the first ones may be due before any thread sleeps.
        if (slack == 1 || ++ticks == 1000) executor->cancel();
      });
      executor->add_node(node);
      spin(*executor);
    }).join();
    return slack.load();
  };
  for (const std::string& type : executors().names()) {
    EXPECT_EQ(slack_in_callback(type, [](Executor& executor) { executor.spin(); }), 1) << type;
  }
  const auto one_by_one = [](Executor& executor) {
    for (int i = 0; i < 100; ++i) executor.spin_once();
  };
  EXPECT_EQ(slack_in_callback("events", one_by_one), 1);
}

}  // namespace
}  // namespace takt
