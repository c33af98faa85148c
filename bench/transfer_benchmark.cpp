// What does it cost to transfer messages between threads?
// `stream`: cost per message when a publisher thread sends as fast as back-pressure permits (it
// waits for a free loan, so no message is lost), compared with a pooled ring on Boost's spsc_queue.
// How long one message takes, hand_over_benchmark measures.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>
#include <boost/lockfree/spsc_queue.hpp>

#include "takt/executors/executor.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

struct Parcel {
  std::uint64_t number = 0;
  std::array<std::byte, 56> payload{};
};
TAKT_MESSAGE(Parcel, "bench/msg/Parcel", number, payload);

constexpr std::size_t kInFlight = 64;
constexpr std::int64_t kBatch = 200'000;

/// The lower bound: a pool of messages, and two rings that carry pointers forth and back.
void stream_bare(benchmark::State& state) {
  std::vector<Parcel> pool(kInFlight);
  boost::lockfree::spsc_queue<Parcel*> full(kInFlight), empty(kInFlight);
  for (Parcel& parcel : pool) empty.push(&parcel);
  std::atomic<bool> stop{false};
  std::atomic<std::int64_t> to_send{0};
  std::jthread producer([&] {
    rt::stay_on(0);
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
  rt::stay_on(1);
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
    rt::stay_on(0);
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
  rt::stay_on(1);
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

}  // namespace
}  // namespace takt
