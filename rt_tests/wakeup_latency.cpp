// How long does it take to wake up a sleeping thread?
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <thread>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr int kWakeUps = 200;

void pause() {
  std::this_thread::sleep_for(300us);  // until the other thread sleeps
}

/// The lower bound: a bare futex.
Histogram bare_futex() {
  Histogram latency;
  std::atomic<TimePoint> sent{TimePoint{}};
  std::atomic<int> turn{0};
  RealtimeThread sleeper(rt::realtime_thread(80), Realtime::prefer, [&] {
    for (int i = 0; i < kWakeUps; ++i) {
      turn.wait(i);
      latency.record(Clock::steady().now() - sent.load());
    }
  });
  for (int i = 1; i <= kWakeUps; ++i) {
    pause();
    sent = Clock::steady().now();
    turn = i;
    turn.notify_one();
  }
  sleeper.join();
  return latency;
}

/// A guard condition of an executor.
Histogram executor(const std::string& name, const std::string& wait) {
  Histogram latency;
  std::atomic<TimePoint> sent{TimePoint{}};
  std::atomic<int> done{0};
  const auto executor = executors().make(
      name, {.name = "sleeper", .wait = wait, .threads = {rt::realtime_thread(80)}});
  const auto node = std::make_shared<Node>("node");
  const auto guard = node->create_guard_condition("guard", [&] {
    latency.record(Clock::steady().now() - sent.load());
    ++done;
  });
  executor->add_node(node);
  std::thread spin([&] { executor->spin(); });
  for (int i = 0; i < kWakeUps; ++i) {
    pause();
    sent = Clock::steady().now();
    guard->trigger();
    while (done == i) std::this_thread::sleep_for(50us);
  }
  executor->cancel();
  spin.join();
  return latency;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  "How long does it take to wake up a sleeping thread (SCHED_FIFO 80) from another "
                  "CPU?");
  test.needs_realtime();
  const CpuDmaLatency dma_latency(0, Realtime::prefer);
  apply({.affinity = {available_cpus().front()}}, Realtime::prefer);
  std::vector<std::string> waits;
  for (const std::string& wait : wait_backends().names()) {
    try {
      wait_backends().make(wait, 1);
      waits.push_back(wait);
    } catch (const Error&) {  // this kernel does not support it
    }
  }
  rt::Rounds bare;
  std::vector<rt::Rounds> rounds(waits.size());
  for (int round = 0; round < test.rounds(9); ++round) {
    bare.add(bare_futex());
    for (std::size_t i = 0; i < waits.size(); ++i) rounds[i].add(executor("events", waits[i]));
  }
  test.add("futex, bare", bare.values());
  for (std::size_t i = 0; i < waits.size(); ++i) {
    test.add("events, wait: " + waits[i], rounds[i].values());
    if (waits[i] != "futex") continue;
    test.expect_at_most(2.5, rounds[i].p50_us, bare.p50_us,
                        "events on futex: p50 is at most 2.5 times the bare futex's");
  }
  return test.finish();
}
