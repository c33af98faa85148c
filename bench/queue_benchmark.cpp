// What do Takt's queues cost, compared with the most similar ones of Boost.Lockfree?
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>
#include <boost/lockfree/queue.hpp>
#include <boost/lockfree/spsc_queue.hpp>

#include "takt/base/lockfree/inbox.hpp"
#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/base/lockfree/pool.hpp"
#include "takt/executors/trace_ring.hpp"

namespace takt {
namespace {

struct Item : PoolNode<Item> {
  Item* inbox_next = nullptr;
};

/// Push and pop on one thread. A second thread is alive, see dispatch_benchmark.cpp.
template <class Round>
void measure(benchmark::State& state, Round&& round) {
  std::atomic<bool> stop{false};
  std::jthread second([&] { stop.wait(false); });
  for ([[maybe_unused]] const auto iteration : state) round();
  stop = true;
  stop.notify_one();
}

template <class Queue>
void boost_queue(benchmark::State& state) {
  Queue queue(16);
  Item item;
  measure(state, [&] {
    Item* out = nullptr;
    queue.push(&item);
    queue.pop(out);
    benchmark::DoNotOptimize(out);
  });
}
BENCHMARK(boost_queue<boost::lockfree::spsc_queue<Item*>>)->Name("boost_spsc_queue");
BENCHMARK(boost_queue<boost::lockfree::queue<Item*>>)->Name("boost_queue");

void keep_last_ring(benchmark::State& state) {
  KeepLastRing<Item> ring(8);
  Item item;
  std::uint64_t sequence = 0;
  measure(state, [&] {
    bool more = false;
    ring.push(&item, ++sequence, 0);
    benchmark::DoNotOptimize(ring.pop([](Item*) {}, more));
  });
}
BENCHMARK(keep_last_ring);

void inbox(benchmark::State& state) {
  Inbox<Item> inbox;
  Item item;
  measure(state, [&] {
    inbox.push(item);
    benchmark::DoNotOptimize(inbox.take_all());
  });
}
BENCHMARK(inbox);

void pool(benchmark::State& state) {
  auto* pool = Pool<Item>::create(16);
  measure(state, [&] {
    Item* item = pool->acquire();
    benchmark::DoNotOptimize(item);
    Pool<Item>::recycle(*item);
  });
  pool->close();
}
BENCHMARK(pool);

/// A trace that is full: the newest executions take the place of the oldest.
void trace_ring(benchmark::State& state) {
  TraceRing ring(1024);
  TraceEvent event;
  measure(state, [&] {
    ++event.sequence;
    ring.record(event);
    benchmark::ClobberMemory();
  });
}
BENCHMARK(trace_ring);

void boost_spsc_queue_as_trace(benchmark::State& state) {
  boost::lockfree::spsc_queue<TraceEvent> queue(1024);
  TraceEvent event, oldest;
  measure(state, [&] {
    ++event.sequence;
    while (!queue.push(event)) queue.pop(oldest);
    benchmark::ClobberMemory();
  });
}
BENCHMARK(boost_spsc_queue_as_trace);

}  // namespace
}  // namespace takt
