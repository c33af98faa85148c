// How the workers of a pool wait: which one searches, and when one is woken.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Tick {
  int number = 0;
};
TAKT_MESSAGE(Tick, "test/msg/Tick", number);

// The timer was armed again before the message that it had sent was served, and no other worker
// waited for it: so one was woken, by the worker that was about to serve the message. In a system
// with a timer of 1 kHz, that was 14 to 39 µs late each time, and both workers slept each time.
TEST(Waiting, ATimersMessageWaitsForNoWakeUpOfAnotherWorker) {
  constexpr std::uint64_t kReleases = 300;
  for (const char* type : {"events", "multi_threaded"}) {
    const auto executor = executors().make(type, {.threads = std::vector<ThreadAttributes>(2)});
    const auto node = std::make_shared<Node>("node");
    const auto publisher = node->create_publisher<Tick>("ticks", 1);
    std::uint64_t received = 0;
    const auto timer = node->create_timer("timer", 1ms, [&] { publisher->publish(Tick{}); });
    const auto subscription = node->create_subscription<Tick>("ticks", 1, [&](const Tick&) {
      if (++received == kReleases) executor->cancel();
    });
    executor->add_node(node);
    executor->spin();
    std::uint64_t sleeps = 0;
    for (const ThreadStatistics& thread : executor->thread_statistics()) {
      sleeps += thread.counters.voluntary_switches;
    }
    EXPECT_LT(sleeps, kReleases * 8 / 5) << type;
  }
}

// While a worker searches, nobody is woken: a thread of more priority would sleep on.
TEST(Waiting, OnlyTheMostUrgentWorkersSearch) {
  ExecutorOptions options{.spin = kMostSpin, .realtime = Realtime::off};
  options.threads = {{.policy = ThreadPolicy::fifo, .priority = 10},
                     {.policy = ThreadPolicy::fifo, .priority = 20}};
  const auto executor = executors().make("multi_threaded", options);
  const auto node = std::make_shared<Node>("node");
  int ticks = 0;
  const auto timer = node->create_timer("timer", 1ms, [&] {
    if (++ticks == 100) executor->cancel();
  });
  executor->add_node(node);
  executor->spin();
  const std::vector<ThreadStatistics> threads = executor->thread_statistics();
  EXPECT_EQ(threads[0].spin_time, 0ns);
  EXPECT_GT(threads[1].spin_time, 0ns);
}

}  // namespace
}  // namespace takt
