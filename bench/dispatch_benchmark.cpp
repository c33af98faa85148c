// What does it cost to dispatch a message to its callback? Two of N nodes play ping-pong inside the
// process, under each executor in turn. The result is the CPU time per callback, including publish.
// The other nodes have an idle timer and an idle subscription. Row `between_threads` is the same
// round trip, written by hand with all atomic operations that messages between threads need, and
// nothing else. It is no lower bound: on an only thread Takt leaves four of them out.
//
// A second thread is always alive, because glibc and libstdc++ skip atomic operations in
// single-threaded programs.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <benchmark/benchmark.h>

#include "takt/base/lockfree/inbox.hpp"
#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/base/lockfree/pool.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

struct Ball {
  std::uint64_t count;
  std::array<std::byte, 56> payload;
};
TAKT_MESSAGE(Ball, "bench/msg/Ball", count, payload);

/// Keeps a second, sleeping thread alive.
class SecondThread {
 public:
  ~SecondThread() {
    stop_.store(true);
    stop_.notify_one();
  }

 private:
  std::atomic<bool> stop_{false};
  std::jthread thread_{[this] { stop_.wait(false); }};
};

// ---- By hand ----

/// A player of the ping-pong by hand. It performs all atomic operations (including loads and
/// stores) that a message between threads needs, but has no entities, groups, scheduler, statistics
/// or wait.
struct HandPlayer : PoolNode<HandPlayer> {
  struct Message : PoolNode<Message> {
    std::atomic<std::uint32_t> references{0};
    std::uint64_t sequence = 0;
    Ball ball{};
  };
  virtual ~HandPlayer() = default;
  virtual void on_message(const Message& message) = 0;

  KeepLastRing<Message> ring{8};
  std::atomic<bool> wants_time{false};
  std::atomic<HandPlayer*> listener{this};
  std::atomic<bool> queued{false}, held{false};
  std::atomic<std::uint32_t> executing{0};
  HandPlayer* inbox_next = nullptr;
};

class HandGame {
 public:
  void send(std::atomic<HandPlayer*>& matched) {
    HandPlayer::Message* message = pool_->acquire();
    ++message->ball.count;
    const ReadSection section;
    HandPlayer& to = *matched.load();
    benchmark::DoNotOptimize(to.wants_time.load(std::memory_order_relaxed));
    message->sequence = next_sequence();
    message->references.store(1, std::memory_order_relaxed);
    to.ring.push(message, message->sequence, 0);
    HandPlayer& listener = *to.listener.load();
    if (!listener.queued.load() && !listener.queued.exchange(true)) inbox_.push(listener);
    benchmark::DoNotOptimize(sleepers_.load());
  }

  void run(std::uint64_t callbacks) {
    while (callbacks != 0 && !cancelled_.load() &&
           plan_.load(std::memory_order_relaxed) == nullptr) {
      for (HandPlayer* player = inbox_.take_all(); player != nullptr && callbacks != 0;) {
        HandPlayer* next = player->inbox_next;
        player->held.store(true, std::memory_order_relaxed);
        player->executing.store(1, std::memory_order_relaxed);
        bool more;
        HandPlayer::Message* message = player->ring.pop([](HandPlayer::Message*) {}, more);
        player->on_message(*message);
        if (message->references.load(std::memory_order_acquire) == 1) {
          Pool<HandPlayer::Message>::recycle(*message);
        }
        if (!more) {
          player->queued.store(false);
          benchmark::DoNotOptimize(player->ring.size());
        }
        player->held.store(false, std::memory_order_relaxed);
        player->executing.store(0, std::memory_order_release);
        --callbacks;
        player = next;
      }
    }
  }

 private:
  PoolPtr<HandPlayer::Message> pool_{Pool<HandPlayer::Message>::create(16)};
  Inbox<HandPlayer> inbox_;
  std::atomic<std::size_t> sleepers_{0};
  std::atomic<bool> cancelled_{false};
  std::atomic<void*> plan_{nullptr};
};

void between_threads(benchmark::State& state) {
  const SecondThread second_thread;
  HandGame game;
  struct Player final : HandPlayer {
    HandGame* game = nullptr;
    std::atomic<HandPlayer*> other{nullptr};
    void on_message(const Message&) override { game->send(other); }
  };
  Player ping, pong;
  ping.game = pong.game = &game;
  ping.other = &pong;
  pong.other = &ping;
  constexpr std::int64_t kBatch = 100'000;
  game.send(pong.other);
  while (state.KeepRunningBatch(kBatch)) game.run(kBatch);
}
BENCHMARK(between_threads);

// ---- Through an executor ----

struct Setup {
  std::string executor;
  StatisticsLevel statistics;
  std::size_t threads;
  bool traced = false;
};

void ping_pong(benchmark::State& state, const Setup& setup) {
  const SecondThread second_thread;
  const auto nodes = static_cast<std::size_t>(state.range(0));
  ExecutorOptions options;
  options.statistics = setup.statistics;
  options.threads.resize(setup.threads);
  options.trace_events = setup.traced ? 4096 : 0;
  const auto executor = executors().make(setup.executor, options);

  std::int64_t left = 0;
  std::vector<std::shared_ptr<void>> parts;
  std::vector<std::shared_ptr<Publisher<Ball>>> publishers;
  for (std::size_t i = 0; i < nodes; ++i) {
    const auto node = std::make_shared<Node>("node_" + std::to_string(i));
    // Two nodes play; the others subscribe to topics without a publisher.
    const auto next = i < 2 ? 1 - i : i + nodes;
    publishers.push_back(node->create_publisher<Ball>("ball_" + std::to_string(next), 8,
                                                      {.loans = i < 2 ? 16u : 0u}));
    Publisher<Ball>& publisher = *publishers.back();
    parts.push_back(node->create_subscription<Ball>(
        "ball_" + std::to_string(i), 8, [&publisher, &left, &executor](const Ball& ball) {
          auto answer = publisher.borrow_loaned_message();
          answer->count = ball.count + 1;
          publisher.publish(std::move(answer));
          if (--left == 0) executor->cancel();
        }));
    parts.push_back(node->create_timer("idle", std::chrono::hours(1), [] {}));
    parts.push_back(node);
    executor->add_node(node);
  }
  publishers[0]->publish(publishers[0]->borrow_loaned_message());
  constexpr std::int64_t kBatch = 100'000;
  while (state.KeepRunningBatch(kBatch)) {
    left = kBatch;
    executor->spin();
  }
}

void register_all() {
  for (const Setup& setup : {Setup{"events", StatisticsLevel::count, 1},
                             {"events", StatisticsLevel::full, 1},
                             {"events", StatisticsLevel::full, 1, true},
                             {"events", StatisticsLevel::count, 2},
                             {"chain_aware", StatisticsLevel::count, 1},
                             {"single_threaded", StatisticsLevel::count, 1},
                             {"single_threaded", StatisticsLevel::full, 1},
                             {"static_single_threaded", StatisticsLevel::count, 1},
                             {"multi_threaded", StatisticsLevel::count, 1},
                             {"multi_threaded", StatisticsLevel::count, 2},
                             {"multi_threaded", StatisticsLevel::full, 2}}) {
    const std::string name =
        "ping_pong/" + setup.executor + "/threads:" + std::to_string(setup.threads) +
        (setup.statistics == StatisticsLevel::full ? "/statistics:full" : "/statistics:count") +
        (setup.traced ? "/traced" : "") + "/nodes";
    benchmark::RegisterBenchmark(name.c_str(),
                                 [setup](benchmark::State& state) { ping_pong(state, setup); })
        ->Arg(2)
        ->Arg(20)
        ->Arg(200)
        ->MeasureProcessCPUTime();
  }
}
const int kRegistered = (register_all(), 0);

}  // namespace
}  // namespace takt
