// Tests of the ring that keeps the newest items.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/keep_last_ring.hpp"

#include <atomic>
#include <barrier>
#include <cstdint>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

// ---- One thread ----

// A ring of numbers that are never freed while it lives, for readable expectations.
class NumberRing {
 public:
  explicit NumberRing(std::size_t depth, std::size_t numbers = 100)
      : ring_(depth), numbers_(numbers) {
    for (std::size_t i = 0; i < numbers; ++i) numbers_[i] = static_cast<int>(i);
  }
  /// The number that had to make room, or -1.
  int push(int number) {
    const int* old = ring_.push(&numbers_[static_cast<std::size_t>(number)],
                                static_cast<std::uint64_t>(number) + 1000, number + 2000);
    return old == nullptr ? -1 : *old;
  }
  int push_here(int number) {
    const int* old = ring_.push_here(&numbers_[static_cast<std::size_t>(number)],
                                     static_cast<std::uint64_t>(number) + 1000, number + 2000);
    return old == nullptr ? -1 : *old;
  }
  int pop() {
    const int* number = ring_.pop([this](int*) { ++dropped_while_popping_; }, more_);
    return number == nullptr ? -1 : *number;
  }
  std::vector<int> drain() {
    std::vector<int> result;
    for (int number; (number = pop()) != -1;) result.push_back(number);
    return result;
  }
  /// The number that `front` reports, or -1.
  int front() const {
    std::uint64_t sequence = 0;
    std::int64_t time_ns = 0;
    if (!ring_.front(sequence, time_ns)) return -1;
    EXPECT_EQ(time_ns, static_cast<std::int64_t>(sequence) + 1000);
    return static_cast<int>(sequence) - 1000;
  }
  std::size_t size() const { return ring_.size(); }
  std::uint64_t pushed() const { return ring_.pushed(); }
  /// The result of the last pop.
  bool more() const { return more_; }
  int dropped_while_popping() const { return dropped_while_popping_; }

 private:
  KeepLastRing<int> ring_;
  std::vector<int> numbers_;
  int dropped_while_popping_ = 0;
  bool more_ = false;
};

TEST(KeepLastRing, IsEmptyAtFirst) {
  NumberRing ring(4);
  EXPECT_EQ(ring.pop(), -1);
  EXPECT_EQ(ring.front(), -1);
  EXPECT_EQ(ring.size(), 0u);
}

TEST(KeepLastRing, GivesItemsInOrderOfArrival) {
  NumberRing ring(4);
  for (const int number : {7, 5, 9}) EXPECT_EQ(ring.push(number), -1);
  EXPECT_EQ(ring.size(), 3u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{7, 5, 9}));
  EXPECT_EQ(ring.size(), 0u);
}

TEST(KeepLastRing, GivesBackTheOldestWhenFull) {
  NumberRing ring(2);
  EXPECT_EQ(ring.push(1), -1);
  EXPECT_EQ(ring.push(2), -1);
  EXPECT_EQ(ring.push(3), 1);
  EXPECT_EQ(ring.push(4), 2);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
}

TEST(KeepLastRing, HasRoomAgainAfterPop) {
  NumberRing ring(2);
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.pop(), 1);
  EXPECT_EQ(ring.push(3), -1);
  EXPECT_EQ(ring.push(4), 2);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
}

TEST(KeepLastRing, ReturnsWithAnItemWhetherThereAreMore) {
  NumberRing ring(3);
  ring.pop();
  EXPECT_FALSE(ring.more());
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.pop(), 1);
  EXPECT_TRUE(ring.more());
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_FALSE(ring.more());
}

TEST(KeepLastRing, CountsAllThatWasPushed) {
  NumberRing ring(2);
  EXPECT_EQ(ring.pushed(), 0u);
  for (int number = 0; number < 5; ++number) ring.push(number);
  EXPECT_EQ(ring.pushed(), 5u);
  ring.drain();
  EXPECT_EQ(ring.pushed(), 5u);
}

TEST(KeepLastRing, OfDepthOneKeepsTheNewestOnly) {
  NumberRing ring(1);
  EXPECT_EQ(ring.push(1), -1);
  EXPECT_EQ(ring.push(2), 1);
  EXPECT_EQ(ring.front(), 2);
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_EQ(ring.push(3), -1);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3}));
}

TEST(KeepLastRing, ReadsTheOldestWithoutTakingIt) {
  NumberRing ring(2);
  ring.push(1);
  ring.push(2);
  EXPECT_EQ(ring.front(), 1);
  EXPECT_EQ(ring.front(), 1);
  ring.push(3);
  EXPECT_EQ(ring.front(), 2);
  EXPECT_EQ(ring.pop(), 2);
  EXPECT_EQ(ring.front(), 3);
  EXPECT_EQ(ring.pop(), 3);
  EXPECT_EQ(ring.front(), -1);
}

TEST(KeepLastRing, KeepsOrderAndDepthWithItemsOfItsTakersThread) {
  NumberRing ring(2);
  EXPECT_EQ(ring.push_here(1), -1);
  EXPECT_EQ(ring.front(), 1);
  EXPECT_EQ(ring.push_here(2), -1);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.push(3), 1);
  EXPECT_EQ(ring.push_here(4), 2);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.drain(), (std::vector<int>{3, 4}));
  EXPECT_EQ(ring.push_here(5), -1);
  EXPECT_EQ(ring.pop(), 5);
  EXPECT_FALSE(ring.more());
  EXPECT_EQ(ring.push_here(6), -1);
  EXPECT_EQ(ring.push(7), -1);
  EXPECT_EQ(ring.pop(), 6);
  EXPECT_TRUE(ring.more());
  EXPECT_EQ(ring.drain(), std::vector<int>{7});
  EXPECT_EQ(ring.pushed(), 7u);
}

// Every depth against a plain model; 70000 tickets, so that the 16 bits in a cell wrap.
TEST(KeepLastRing, BehavesLikeABoundedQueueAtAnyDepthAndBeyondTheTicketWrap) {
  for (const std::size_t depth : {1u, 2u, 3u, 5u, 7u, 10u, 64u, 100u, 1000u}) {
    constexpr int kPushes = 70'000;
    NumberRing ring(depth, kPushes);
    std::mt19937 random(static_cast<unsigned>(depth));
    int oldest = 0;  // the model holds [oldest, next)
    for (int next = 0; next < kPushes;) {
      const int held = next - oldest;
      if (random() % 5 < 3) {
        const int old = random() % 2 == 0 ? ring.push(next) : ring.push_here(next);
        ASSERT_EQ(old, held == static_cast<int>(depth) ? oldest : -1) << depth;
        if (held == static_cast<int>(depth)) ++oldest;
        ++next;
      } else {
        ASSERT_EQ(ring.front(), held == 0 ? -1 : oldest) << depth;
        ASSERT_EQ(ring.pop(), held == 0 ? -1 : oldest) << depth;
        if (held != 0) ++oldest;
      }
      ASSERT_EQ(ring.size(), static_cast<std::size_t>(next - oldest)) << depth;
    }
    EXPECT_EQ(ring.dropped_while_popping(), 0);
  }
}

TEST(KeepLastRing, HoldsItsGreatestDepth) {
  constexpr int kDepth = KeepLastRing<int>::kMaxDepth;
  NumberRing ring(kDepth, 5 * kDepth);  // more than 65536 tickets
  for (int number = 0; number < 5 * kDepth; ++number) {
    ASSERT_EQ(ring.push(number), number < kDepth ? -1 : number - kDepth);
  }
  EXPECT_EQ(ring.size(), std::size_t{kDepth});
  for (int number = 4 * kDepth; number < 5 * kDepth; ++number) ASSERT_EQ(ring.pop(), number);
  EXPECT_EQ(ring.pop(), -1);
}

TEST(KeepLastRing, PushesAndPopsWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  NumberRing ring(3);
  const RealtimeScope scope;
  for (int number = 0; number < 10; ++number) ring.push(number);
  const int first = ring.pop();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(first, 7);
}

// ---- Several threads ----

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
  constexpr int kRounds = 200, kPublishers = 2;
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
  constexpr int kRounds = 20'000;
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
    if (++round < kRounds) begin_round();
  };
  begin_round();
  std::barrier step(kPublishers + kTakers, check_round);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kPublishers + kTakers; ++thread) {
    threads.emplace_back([&, thread] {
      std::mt19937 random(static_cast<unsigned>(thread));
      for (int i = 0; i < kRounds; ++i) {
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
  EXPECT_EQ(round, kRounds);
}

}  // namespace
}  // namespace takt
