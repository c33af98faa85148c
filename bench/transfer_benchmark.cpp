// What does it cost to transfer messages between threads?
// `stream`: cost per message when a publisher thread sends as fast as back-pressure permits (it
// waits for a free loan, so no message is lost), compared with a pooled ring on Boost's spsc_queue.
// `hand_over`: time from publish to the callback of a sleeping thread, compared with a bare futex;
// rounds alternate.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>
#include <boost/lockfree/spsc_queue.hpp>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/histogram.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Parcel {
  std::uint64_t number = 0;
  TimePoint sent;
  std::array<std::byte, 48> payload{};
};
TAKT_MESSAGE(Parcel, "bench/msg/Parcel", number, payload);

constexpr std::size_t kInFlight = 64;
constexpr std::int64_t kBatch = 200'000;

void stay_on(int cpu) {
  if (available_cpus().size() > 1) {
    apply({.affinity = {available_cpus()[static_cast<std::size_t>(cpu)]}}, Realtime::off);
  }
}

/// The lower bound: a pool of messages, and two rings that carry pointers forth and back.
void stream_bare(benchmark::State& state) {
  std::vector<Parcel> pool(kInFlight);
  boost::lockfree::spsc_queue<Parcel*> full(kInFlight), empty(kInFlight);
  for (Parcel& parcel : pool) empty.push(&parcel);
  std::atomic<bool> stop{false};
  std::atomic<std::int64_t> to_send{0};
  std::jthread producer([&] {
    stay_on(0);
    std::uint64_t number = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (to_send.load(std::memory_order_relaxed) <= 0) continue;
      for (std::int64_t i = 0; i < kBatch; ++i) {
        Parcel* parcel;
        while (!empty.pop(parcel)) {
        }
        parcel->number = ++number;
        full.push(parcel);
      }
      to_send.fetch_sub(kBatch);
    }
  });
  stay_on(1);
  while (state.KeepRunningBatch(kBatch)) {
    to_send.fetch_add(kBatch);
    for (std::int64_t i = 0; i < kBatch; ++i) {
      Parcel* parcel;
      while (!full.pop(parcel)) {
      }
      benchmark::DoNotOptimize(parcel->number);
      empty.push(parcel);
    }
  }
  stop = true;
}
BENCHMARK(stream_bare)->UseRealTime();

void stream(benchmark::State& state, const std::string& executor_name) {
  ExecutorOptions options;
  options.statistics = StatisticsLevel::count;
  options.threads.resize(1);
  const auto executor = executors().make(executor_name, options);
  const auto sender = std::make_shared<Node>("sender");
  const auto receiver = std::make_shared<Node>("receiver");
  const auto publisher =
      sender->create_publisher<Parcel>("parcels", kInFlight, {.loans = kInFlight});
  std::int64_t left = 0;
  std::uint64_t last = 0, lost = 0;
  const auto subscription =
      receiver->create_subscription<Parcel>("parcels", kInFlight, [&](const Parcel& parcel) {
        lost += parcel.number - last - 1;
        last = parcel.number;
        if (--left == 0) executor->cancel();
      });
  executor->add_node(receiver);
  std::atomic<bool> stop{false};
  std::atomic<std::int64_t> to_send{0};
  std::jthread producer([&] {
    stay_on(0);
    std::uint64_t number = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (to_send.load(std::memory_order_relaxed) <= 0) continue;
      for (std::int64_t i = 0; i < kBatch; ++i) {
        LoanedMessage<Parcel> parcel;
        while (!(parcel = publisher->borrow_loaned_message())) {
        }
        parcel->number = ++number;
        publisher->publish(std::move(parcel));
      }
      to_send.fetch_sub(kBatch);
    }
  });
  stay_on(1);
  while (state.KeepRunningBatch(kBatch)) {
    left = kBatch;
    to_send.fetch_add(kBatch);
    executor->spin();
  }
  stop = true;
  if (lost != 0) state.SkipWithError("messages were lost");
}
BENCHMARK_CAPTURE(stream, events, "events")->UseRealTime();
BENCHMARK_CAPTURE(stream, single_threaded, "single_threaded")->UseRealTime();

// ---- Hand-over ----

long futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  return syscall(SYS_futex, &word, operation, value, nullptr, nullptr, 0);
}

/// Alternating rounds of the two; each posts `kPosts` times to a sleeping thread.
void report(benchmark::State& state, const Histogram& bare, const Histogram& through_executor) {
  const auto us = [](const Histogram& histogram, double fraction) {
    return static_cast<double>(histogram.percentile(fraction).count()) / 1e3;
  };
  state.counters["futex_p50_us"] = us(bare, 0.5);
  state.counters["futex_p99_us"] = us(bare, 0.99);
  state.counters["takt_p50_us"] = us(through_executor, 0.5);
  state.counters["takt_p99_us"] = us(through_executor, 0.99);
  state.counters["p50_ratio"] = us(through_executor, 0.5) / us(bare, 0.5);
}

void hand_over(benchmark::State& state, const std::string& executor_name) {
  constexpr int kRounds = 20, kPosts = 100;
  Histogram bare, through_executor;

  std::atomic<std::uint32_t> word{0};
  TimePoint posted;
  std::jthread sleeper([&] {
    stay_on(1);
    for (;;) {
      std::uint32_t value;
      while ((value = word.exchange(0)) == 0) futex(word, FUTEX_WAIT_PRIVATE, 0);
      if (value == 2) return;
      bare.record(Clock::steady().now() - posted);
    }
  });

  ExecutorOptions options;
  options.statistics = StatisticsLevel::count;
  options.threads.resize(1);
  const auto executor = executors().make(executor_name, options);
  const auto node = std::make_shared<Node>("node");
  const auto publisher = node->create_publisher<Parcel>("parcels", 8, {.loans = 8});
  const auto subscription = node->create_subscription<Parcel>(
      "parcels", 8,
      [&](const Parcel& parcel) { through_executor.record(Clock::steady().now() - parcel.sent); });
  executor->add_node(node);
  std::jthread spinner([&] {
    stay_on(1);
    executor->spin();
  });
  stay_on(0);
  for ([[maybe_unused]] auto _ : state) {
    for (int round = 0; round < kRounds; ++round) {
      for (int post = 0; post < kPosts; ++post) {
        std::this_thread::sleep_for(100us);
        posted = Clock::steady().now();
        word.store(1);
        futex(word, FUTEX_WAKE_PRIVATE, 1);
      }
      for (int post = 0; post < kPosts; ++post) {
        std::this_thread::sleep_for(100us);
        auto parcel = publisher->borrow_loaned_message();
        parcel->sent = Clock::steady().now();
        publisher->publish(std::move(parcel));
      }
    }
  }
  word.store(2);
  futex(word, FUTEX_WAKE_PRIVATE, 1);
  executor->cancel();
  spinner.join();
  sleeper.join();
  report(state, bare, through_executor);
}
BENCHMARK_CAPTURE(hand_over, events, "events")->Iterations(2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(hand_over, single_threaded, "single_threaded")
    ->Iterations(2)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace takt
