// Rounds of several threads on the ring that keeps the newest items.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <barrier>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt {
namespace {

struct Item {
  int publisher;
  int number;
};

// Counts what becomes of each item, and frees it at once: the address sanitizer catches a thread
// that still reads it then.
class Ledger {
 public:
  Ledger(int publishers, int items) : items_(items), ends_(new End[publishers * items]) {}

  void taken(Item* item) { end(item, ends_[index(*item)].taken); }
  void given_back(Item* item) { end(item, ends_[index(*item)].given_back); }

  bool was_taken(int publisher, int number) const {
    return ends_[publisher * items_ + number].taken == 1;
  }
  void expect_one_end_each(int publishers) const {
    for (int i = 0; i < publishers * items_; ++i) {
      ASSERT_EQ(ends_[i].taken + ends_[i].given_back, 1)
          << "item " << i % items_ << " of publisher " << i / items_;
    }
  }

 private:
  struct End {
    std::atomic<int> taken{0}, given_back{0};
  };
  int index(const Item& item) const { return item.publisher * items_ + item.number; }
  static void end(Item* item, std::atomic<int>& count) {
    count.fetch_add(1, std::memory_order_relaxed);
    delete item;
  }

  const int items_;
  const std::unique_ptr<End[]> ends_;
};

// What one taker sees of each publisher must never go backwards.
class Watcher {
 public:
  explicit Watcher(int publishers) : last_(static_cast<std::size_t>(publishers), -1) {}
  void see(const Item& item) {
    int& last = last_[static_cast<std::size_t>(item.publisher)];
    EXPECT_GT(item.number, last) << "publisher " << item.publisher;
    last = item.number;
  }

 private:
  std::vector<int> last_;
};

struct Setting {
  std::size_t depth;
  int publishers, takers, items;
};

void push_one(KeepLastRing<Item>& ring, Ledger& ledger, int publisher, int number) {
  if (Item* old = ring.push(new Item{publisher, number}, 0, 0)) ledger.given_back(old);
}

bool take_one(KeepLastRing<Item>& ring, Ledger& ledger, Watcher& watcher) {
  bool more;
  Item* item = ring.pop([&](Item* old) { ledger.given_back(old); }, more);
  if (item == nullptr) return false;
  watcher.see(*item);
  ledger.taken(item);
  return true;
}

void run(const Setting& setting) {
  KeepLastRing<Item> ring(setting.depth);
  Ledger ledger(setting.publishers, setting.items);
  std::atomic<int> publishing{setting.publishers};
  std::barrier start(setting.publishers + setting.takers);
  std::vector<std::thread> threads;
  for (int publisher = 0; publisher < setting.publishers; ++publisher) {
    threads.emplace_back([&, publisher] {
      start.arrive_and_wait();
      for (int i = 0; i < setting.items; ++i) push_one(ring, ledger, publisher, i);
      publishing.fetch_sub(1);
    });
  }
  for (int taker = 0; taker < setting.takers; ++taker) {
    threads.emplace_back([&] {
      Watcher watcher(setting.publishers);
      start.arrive_and_wait();
      for (;;) {
        const bool was_last_look = publishing.load() == 0;
        if (take_one(ring, ledger, watcher)) continue;
        if (was_last_look) return;
        std::this_thread::yield();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ring.pushed(), static_cast<std::uint64_t>(setting.publishers * setting.items));
  bool more = true;
  EXPECT_EQ(ring.pop([](Item*) { FAIL(); }, more), nullptr);
  EXPECT_FALSE(more);
  ledger.expect_one_end_each(setting.publishers);
}

TEST(KeepLastRingStress, OnePublisherAndOneTakerEndEachItemOnceAndInOrder) {
  run({.depth = 3, .publishers = 1, .takers = 1, .items = 30'000});
}

TEST(KeepLastRingStress, SeveralPublishersAndOneTakerEndEachItemOnceAndInOrder) {
  run({.depth = 5, .publishers = 3, .takers = 1, .items = 15'000});
}

TEST(KeepLastRingStress, SeveralPublishersAndTakersEndEachItemOnceAndInOrder) {
  for (const std::size_t depth : {1u, 2u, 3u, 8u, 100u}) {
    run({.depth = depth, .publishers = 3, .takers = 3, .items = 8'000});
  }
}

TEST(KeepLastRingStress, ManyPublishersLeaveExactlyDepthItemsBehind) {
  constexpr int kPublishers = 4;
  constexpr int kItems = 4000;
  for (const std::size_t depth : {1u, 3u, 16u}) {
    KeepLastRing<Item> ring(depth);
    Ledger ledger(kPublishers, kItems);
    std::barrier start(kPublishers);
    std::vector<std::thread> threads;
    for (int publisher = 0; publisher < kPublishers; ++publisher) {
      threads.emplace_back([&, publisher] {
        start.arrive_and_wait();
        for (int i = 0; i < kItems; ++i) push_one(ring, ledger, publisher, i);
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(ring.size(), depth);
    Watcher watcher(kPublishers);
    std::size_t left = 0;
    while (take_one(ring, ledger, watcher)) ++left;
    EXPECT_EQ(left, depth);
    ledger.expect_one_end_each(kPublishers);
  }
}

// On one CPU a thread is often preempted between two steps of push or pop, and for as long as it
// takes the others to wrap the 16 bits of a ticket that a cell holds.
TEST(KeepLastRingStress, LosesNothingWhenAThreadIsAwayForTensOfThousandsOfTickets) {
  constexpr int kRounds = 50 / kFewerSanitized, kPublishers = 2;
  constexpr std::uint64_t kPushes = 300'000;
  const int cpu = sched_getcpu();
  for (int round = 0; round < kRounds; ++round) {
    KeepLastRing<int> ring(2);
    int item = 0;
    bool more = true;
    std::atomic<std::uint64_t> ended{0};  // taken or given back
    const auto publish = [&] {
      cpu_set_t cpus;
      CPU_ZERO(&cpus);
      CPU_SET(cpu, &cpus);
      EXPECT_EQ(pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus), 0);
      for (std::uint64_t i = 0; i < kPushes; ++i) {
        if (ring.push(&item, 0, 0) != nullptr) ++ended;
      }
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < kPublishers; ++i) threads.emplace_back(publish);
    for (std::thread& thread : threads) thread.join();
    while (more) {
      if (ring.pop([&](int*) { ++ended; }, more) != nullptr) ++ended;
    }
    ASSERT_EQ(ended, kPublishers * kPushes) << "in round " << round;
  }
}

// Very short runs on very small rings, so that the few steps of push and pop meet in as many ways
// as the machine will let them: two publishers and two takers of three operations each, with
// seeded pauses between the operations. This samples interleavings of whole operations and, by
// preemption and the second core, of the steps inside them; it does not enumerate them, and the
// seed fixes the pauses but not what the kernel does. What it checks holds for every one of them:
// 1. each item is taken or given back exactly once;
// 2. no taker sees a publisher's items out of order;
// 3. the item of the last ticket is never given back, so of at least one publisher the last item
//    was taken or is still there at the end.
TEST(KeepLastRingStress, KeepsItsPromisesInManyTinyRuns) {
  const char* const given = std::getenv("TAKT_STRESS_ROUNDS");  // by ./dev stress
  const int rounds = given != nullptr ? std::atoi(given) : 4'000;
  constexpr int kPublishers = 2, kTakers = 2, kOperations = 3;
  std::unique_ptr<KeepLastRing<Item>> ring;
  std::unique_ptr<Ledger> ledger;
  int round = 0;
  const auto begin_round = [&] {
    ring = std::make_unique<KeepLastRing<Item>>(static_cast<std::size_t>(1 + round % 3));
    ledger = std::make_unique<Ledger>(kPublishers, kOperations);
  };
  const auto check_round = [&]() noexcept {
    Watcher watcher(kPublishers);
    std::size_t left = 0;
    while (take_one(*ring, *ledger, watcher)) ++left;
    EXPECT_LE(left, ring->depth());
    ledger->expect_one_end_each(kPublishers);
    EXPECT_TRUE(ledger->was_taken(0, kOperations - 1) || ledger->was_taken(1, kOperations - 1))
        << "round " << round;
    if (++round < rounds) begin_round();
  };
  begin_round();
  std::barrier step(kPublishers + kTakers, check_round);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kPublishers + kTakers; ++thread) {
    threads.emplace_back([&, thread] {
      std::mt19937 random(static_cast<unsigned>(thread));
      for (int i = 0; i < rounds; ++i) {
        Watcher watcher(kPublishers);
        for (int operation = 0; operation < kOperations; ++operation) {
          const unsigned pause = random() % 64;
          if (pause == 0) std::this_thread::yield();
          for (unsigned spin = 0; spin < pause; ++spin) asm volatile("" ::: "memory");
          if (thread < kPublishers) {
            push_one(*ring, *ledger, thread, operation);
          } else {
            take_one(*ring, *ledger, watcher);
          }
        }
        step.arrive_and_wait();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(round, rounds);
}

}  // namespace
}  // namespace takt
