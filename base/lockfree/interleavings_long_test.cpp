// Runs the ring and the pool through all interleavings of a few operations with a few preemptions.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "takt/testing/explorer.hpp"

#define takt takt_explored
#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/base/lockfree/pool.hpp"
#undef takt

namespace takt_explored {

// The other half of pool.hpp, which is not explored, and its memory.
void* set_aside(std::size_t bytes, std::size_t alignment) {
  return ::operator new(bytes, std::align_val_t(alignment));
}
void give_back(void* memory, std::size_t, std::size_t alignment) noexcept {
  ::operator delete(memory, std::align_val_t(alignment));
}
void PoolBase::sweep(PoolBase* closed) noexcept {
  if (closed != nullptr && closed->all_home()) delete closed;
}

namespace {

// So many preemptions fewer than in `./dev stress`, which takes five times as long.
int fewer() {
  static const bool all = std::getenv("TAKT_STRESS_ROUNDS") != nullptr;
  return all ? 0 : 1;
}

// ---- The ring ----

constexpr int kNeverHappened = std::numeric_limits<int>::max();

struct Item {
  int push_begins = kNeverHappened, push_ends = kNeverHappened;
  // The operation that took it or gave it back.
  int end_begins = kNeverHappened, end_ends = kNeverHappened;
  int taken = 0, given_back = 0;
};
// A pop that reported nothing more.
struct LastPop {
  int begins, ends;
};

struct RingScenario {
  std::size_t depth;
  std::vector<int> pushes;  // of each publisher
  std::vector<int> pops;    // of each taker
  int preemptions;
  std::string own = {};  // of the only taker: 'h' for push_here, 'p' for pop
};

class RingRun {
 public:
  explicit RingRun(const RingScenario& scenario) : scenario_(scenario), ring_(scenario.depth) {}

  Explorer::Bodies bodies() {
    Explorer::Bodies result;
    for (const int count : scenario_.pushes) {
      result.emplace_back([this, count] {
        for (int i = 0; i < count; ++i) push();
      });
    }
    for (const int count : scenario_.pops) {
      result.emplace_back([this, count] {
        for (int i = 0; i < count; ++i) pop();
      });
    }
    if (!scenario_.own.empty()) {
      result.emplace_back([this] {
        for (const char operation : scenario_.own) {
          if (operation == 'h') {
            push(true);
          } else {
            pop();
          }
        }
      });
    }
    return result;
  }

  /// What is wrong with this run; empty if nothing is.
  std::string check() {
    const int end_of_run = now_;
    std::size_t left = 0;
    while (pop()) ++left;
    if (left > scenario_.depth) return "more is left than fits";
    if (scenario_.pops.empty() && scenario_.own.empty() &&
        left != std::min(scenario_.depth, items_.size())) {
      return "nobody took anything, but not the last items are left";
    }
    if (ring_.pushed() != items_.size()) return "pushed() is wrong";
    for (const Item& item : items_) {
      if (item.taken + item.given_back != 1) return "an item has not exactly one end";
      if (item.given_back != 0 && successors(item) < scenario_.depth) {
        return "an item was given back for fewer than depth newer ones";
      }
      for (const Item& later : items_) {
        if (item.push_ends < later.push_begins && item.taken == 1 && later.taken == 1 &&
            later.end_ends < item.end_begins) {
          return "a newer item was taken first";
        }
      }
      for (const LastPop& last : last_pops_) {
        if (last.ends <= end_of_run && item.push_ends < last.begins &&
            item.end_begins > last.ends) {
          return "a pop overlooked an item that was there all the time";
        }
      }
    }
    return {};
  }

 private:
  void push(bool here = false) {
    Item& item = items_.emplace_back();
    item.push_begins = ++now_;
    Item* old = here ? ring_.push_here(&item, 0, 0) : ring_.push(&item, 0, 0);
    if (old != nullptr) give_back(*old, item.push_begins);
    item.push_ends = ++now_;
  }
  bool pop() {
    const int begins = ++now_;
    bool more = true;
    Item* item = ring_.pop([&](Item* old) { give_back(*old, begins); }, more);
    const int ends = ++now_;
    if (!more) last_pops_.push_back({begins, ends});
    if (item == nullptr) return false;
    ++item->taken;
    item->end_begins = begins;
    item->end_ends = ends;
    return true;
  }
  void give_back(Item& item, int begins) {
    ++item.given_back;
    item.end_begins = begins;
    item.end_ends = ++now_;
  }
  /// How many pushes may count as newer than the item and had begun when it was given back.
  std::size_t successors(const Item& item) const {
    return static_cast<std::size_t>(
        std::count_if(items_.begin(), items_.end(), [&](const Item& other) {
          return &other != &item && other.push_ends > item.push_begins &&
                 other.push_begins < item.end_ends;
        }));
  }

  const RingScenario& scenario_;
  KeepLastRing<Item> ring_;
  std::deque<Item> items_;
  std::vector<LastPop> last_pops_;
  int now_ = 0;
};

// Returns how many schedules were tried; fails with the first promise that was broken.
std::size_t explore(const RingScenario& scenario) {
  Explorer explorer;
  std::unique_ptr<RingRun> run;
  std::string broken;
  const std::size_t schedules = explorer.explore(
      scenario.preemptions,
      [&] {
        run = std::make_unique<RingRun>(scenario);
        return run->bodies();
      },
      [&] {
        if (std::string what = run->check(); broken.empty()) broken = std::move(what);
      });
  EXPECT_EQ(broken, "") << "with depth " << scenario.depth;
  return schedules;
}

TEST(KeepLastRingInterleavings, OfTwoPublishersKeepTheLastItems) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const std::size_t depth : {1u, 2u, 3u}) {
    EXPECT_GT(explore({.depth = depth, .pushes = {2, 3}, .pops = {}, .preemptions = 4 - fewer()}),
              100u);
  }
}

TEST(KeepLastRingInterleavings, OfOnePublisherAndOneTakerKeepEveryPromise) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const std::size_t depth : {1u, 2u, 3u}) {
    EXPECT_GT(explore({.depth = depth, .pushes = {4}, .pops = {3}, .preemptions = 4 - fewer()}),
              100u);
  }
}

TEST(KeepLastRingInterleavings, OfTwoPublishersAndOneTakerKeepEveryPromise) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const std::size_t depth : {1u, 2u, 3u}) {
    EXPECT_GT(explore({.depth = depth, .pushes = {1, 3}, .pops = {3}, .preemptions = 3 - fewer()}),
              100u);
  }
}

TEST(KeepLastRingInterleavings, OfTwoPublishersAndTwoTakersKeepEveryPromise) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const std::size_t depth : {1u, 2u}) {
    EXPECT_GT(
        explore({.depth = depth, .pushes = {2, 2}, .pops = {2, 2}, .preemptions = 2 - fewer()}),
        100u);
  }
}

// The ring held one item more than its depth, when a publisher had not seen the taker's own item.
TEST(KeepLastRingInterleavings, OfOnePublisherAndATakerThatPublishesKeepEveryPromise) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const std::size_t depth : {1u, 2u, 3u}) {
    for (const char* own : {"hhphp", "hphpp", "phhhp", "hpphp", "h", "phh"}) {
      EXPECT_GT(
          explore(
              {.depth = depth, .pushes = {3}, .pops = {}, .preemptions = 3 - fewer(), .own = own}),
          100u);
    }
  }
}

// ---- The pool ----

struct Tool : PoolNode<Tool> {
  int borrowers = 0;
};

class PoolRun {
 public:
  explicit PoolRun(std::size_t capacity) : pool_(Pool<Tool>::create(capacity, /*at_once=*/1)) {}

  /// A borrower that acquires for each 'a' and gives back what it has held longest for each 'r'.
  std::function<void()> borrower(const std::string& operations) {
    std::deque<Tool*>& held = held_.emplace_back();
    std::size_t holds = 0, most = 0;
    for (const char operation : operations) {
      holds = operation == 'a' ? holds + 1 : std::max<std::size_t>(holds, 1) - 1;
      most = std::max(most, holds);
    }
    most_held_ += most;
    return [this, &held, operations] {
      for (const char operation : operations) {
        if (operation == 'a') {
          has_found_none_ |= !acquire(held);
        } else if (!held.empty()) {
          recycle(held);
        }
      }
    };
  }

  std::string check() {
    for (std::deque<Tool*>& held : held_) {
      while (!held.empty()) recycle(held);
    }
    std::deque<Tool*> all;
    while (all.size() <= pool_->capacity() && acquire(all)) {
    }
    if (lent_twice_) return "an object was lent twice";
    if (all.size() != pool_->capacity()) return "objects were lost";
    while (!all.empty()) recycle(all);
    if (has_found_none_ && most_held_ <= pool_->capacity()) return "a free object was not found";
    return {};
  }

 private:
  bool acquire(std::deque<Tool*>& held) {
    Tool* tool = pool_->acquire();
    if (tool == nullptr) return false;
    lent_twice_ = lent_twice_ || ++tool->borrowers != 1;
    held.push_back(tool);
    return true;
  }
  static void recycle(std::deque<Tool*>& held) {
    Tool* tool = held.front();
    held.pop_front();
    --tool->borrowers;
    Pool<Tool>::recycle(*tool);
  }

  const PoolPtr<Tool> pool_;
  std::deque<std::deque<Tool*>> held_;
  std::size_t most_held_ = 0;  // by all borrowers together
  bool lent_twice_ = false, has_found_none_ = false;
};

std::size_t explore(std::size_t capacity, const std::vector<std::string>& borrowers,
                    int preemptions) {
  Explorer explorer;
  std::unique_ptr<PoolRun> run;
  std::string broken;
  const std::size_t schedules = explorer.explore(
      preemptions,
      [&] {
        run = std::make_unique<PoolRun>(capacity);
        Explorer::Bodies bodies;
        for (const std::string& operations : borrowers) bodies.push_back(run->borrower(operations));
        return bodies;
      },
      [&] {
        if (std::string what = run->check(); broken.empty()) broken = std::move(what);
      });
  EXPECT_EQ(broken, "") << "with capacity " << capacity;
  return schedules;
}

// The long one does what could deceive the other: while that is inside an acquire, the object that
// it saw first goes out and comes back first, with another behind it (the ABA problem).
TEST(PoolInterleavings, NeverLendAnObjectTwiceOrLoseOne) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  EXPECT_GT(explore(3, {"ar", "aaarrraraaa"}, 3 - fewer()), 100u);
  EXPECT_GT(explore(3, {"arar", "aararr"}, 4 - fewer()), 100u);
  EXPECT_GT(explore(2, {"ar", "ar", "arar"}, 3 - fewer()), 100u);
}

// Each finds one whatever the others are about to do with the lists.
TEST(PoolInterleavings, LendAFreeObjectToWhoeverAsks) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  EXPECT_GT(explore(2, {"arara", "arara"}, 4 - fewer()), 100u);
  EXPECT_GT(explore(3, {"ara", "arar", "ara"}, 3 - fewer()), 100u);
  EXPECT_GT(explore(4, {"aarar", "aarra"}, 4 - fewer()), 100u);
}

}  // namespace
}  // namespace takt_explored
