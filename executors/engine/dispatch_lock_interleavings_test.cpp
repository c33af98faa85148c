// Runs the dispatch lock through all interleavings of a few operations with a few preemptions, and
// with stores of the favourite that reach memory late.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linux/futex.h>
#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/testing/explorer.hpp"

// ---- What the lock uses, as the explorer runs it ----

#define TAKT_BASE_PI_MUTEX_HPP_
#define TAKT_BASE_SPIN_PAUSE_HPP_

namespace takt_explored {

/// The kernel, as far as it deals with the lock.
struct Kernel {
  std::deque<std::size_t> waiters;  // contexts, in order
  bool has_barrier = true;          // else its barrier does nothing: then the lock must break
  bool wakes = true;                // else a waiter sleeps on
  bool is_patient = true;           // waiters spin until the next lets go; else they block
};
Kernel kernel;

std::uint32_t thread_of(std::size_t context) {
  return static_cast<std::uint32_t>(context) + 100;
}
std::size_t prepared = 0;  // outside of a run: the context that one prepares

std::uint32_t gettid() {
  const std::size_t context = Explorer::current();
  return thread_of(context == Explorer::kNobody ? prepared : context);
}

void spin_pause() {
  if (kernel.is_patient) Explorer::yield();
}

long syscall(long, int command, int, int) {
  if (command != MEMBARRIER_CMD_PRIVATE_EXPEDITED) return 0;
  Explorer::point();
  if (kernel.has_barrier) Explorer::fence_all();
  return 0;
}

// futex(2), FUTEX_LOCK_PI and FUTEX_UNLOCK_PI: the kernel's own accesses are atomic.
long syscall(long, std::atomic<std::uint32_t>* word, int operation, int, std::nullptr_t) {
  Explorer::point();
  Explorer::fence();
  const auto read = [word] { return word->peek(); };
  const std::uint32_t self = gettid();
  if (operation == FUTEX_LOCK_PI_PRIVATE) {
    if ((read() & FUTEX_TID_MASK) == 0) {
      word->poke(self | (kernel.waiters.empty() ? 0 : FUTEX_WAITERS));
      return 0;
    }
    if ((read() & FUTEX_TID_MASK) == self) return -1;  // EDEADLK
    word->poke(read() | FUTEX_WAITERS);
    kernel.waiters.push_back(Explorer::current());
    Explorer::block();
    return 0;
  }
  if ((read() & FUTEX_TID_MASK) != self) return -1;  // EPERM
  if (kernel.waiters.empty() || !kernel.wakes) {
    word->poke(0);
    return 0;
  }
  const std::size_t next = kernel.waiters.front();
  kernel.waiters.pop_front();
  word->poke(thread_of(next) | FUTEX_WAITERS);  // the kernel sets it, even if no more wait
  Explorer::wake(next);
  return 0;
}

class PiMutex {
 public:
  void lock() {
    Explorer::point();
    Explorer::fence();
    while (is_locked_) {
      waiters_.push_back(Explorer::current());
      Explorer::block();
    }
    is_locked_ = true;
  }
  void unlock() {
    Explorer::point();
    Explorer::fence();
    is_locked_ = false;
    for (const std::size_t waiter : waiters_) Explorer::wake(waiter);
    waiters_.clear();
  }

 private:
  bool is_locked_ = false;
  std::vector<std::size_t> waiters_;
};

}  // namespace takt_explored

#define takt takt_explored
#include "takt/executors/engine/dispatch_lock.cpp"  // NOLINT(bugprone-suspicious-include)
#undef takt

namespace takt_explored {
namespace {

struct Scenario {
  /// Of each worker: 'd' locks and unlocks, 'l' the same with unlock_and_leave, 't' tries to.
  std::vector<std::string> workers;
  int before;  // how often the first has had the lock already: it becomes the favourite with 65
  int preemptions, delays;
};

struct Case {
  std::vector<std::string> workers;
  int preemptions, delays;
};
const std::vector<Case> kCases{{{"dd", "d"}, 4, 0},     {{"ddd", "dd"}, 3, 0}, {{"ld", "ld"}, 3, 0},
                               {{"d", "d", "d"}, 2, 0}, {{"dd", "d"}, 3, 1},   {{"dd", "dl"}, 2, 2},
                               {{"td", "d"}, 3, 0},     {{"dt", "td"}, 2, 1}};

constexpr int kAlmostFavourite = 63, kFavourite = 80;

/// What was wrong in the first run in which something was; empty if nothing was.
std::string explore(const Scenario& scenario) {
  std::string wrong;
  std::unique_ptr<detail::DispatchLock> lock;
  int inside = 0;
  std::size_t dispatches = 0, expected = 0;
  for (const std::string& worker : scenario.workers) {
    expected += worker.size() - static_cast<std::size_t>(std::ranges::count(worker, 't'));
  }
  const auto begin = [&] {
    kernel.waiters.clear();
    lock = std::make_unique<detail::DispatchLock>(scenario.workers.size(), true);
    inside = 0;
    dispatches = 0;
    Explorer::Bodies bodies;
    for (std::size_t i = 0; i < scenario.workers.size(); ++i) {
      prepared = i;
      bodies.emplace_back([&, i, &self = lock->enter(i)] {
        for (const char operation : scenario.workers[i]) {
          const auto is_inside = [&] {
            if (++inside != 1 && wrong.empty()) wrong = "two are inside";
            Explorer::point();
            --inside;
          };
          if (operation == 't') {
            lock->try_run(self, is_inside);
            continue;
          }
          lock->lock(self);
          is_inside();
          ++dispatches;
          if (operation == 'l') {
            lock->unlock_and_leave(self);
          } else {
            lock->unlock(self);
          }
        }
      });
    }
    prepared = 0;
    auto& first = lock->enter(0);
    for (int i = 0; i < scenario.before; ++i) {
      lock->lock(first);
      lock->unlock(first);
    }
    return bodies;
  };
  Explorer explorer;
  const std::size_t schedules = explorer.explore(
      scenario.preemptions, begin,
      [&] {
        if (wrong.empty() && explorer.stuck() != 0) wrong = "a worker waits for ever";
        if (wrong.empty() && dispatches != expected) wrong = "a worker has not had its turn";
      },
      scenario.delays);
  EXPECT_GT(schedules, 3u);
  return wrong;
}

TEST(DispatchLockInterleavings, OneWorkerIsInsideAndEachHasItsTurn) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  for (const int before : {0, kAlmostFavourite, kFavourite}) {
    for (const auto& [workers, preemptions, delays] : kCases) {
      for (const bool is_patient : {true, false}) {
        // Two that look in turn would have too many schedules.
        if (is_patient && workers.size() > 2) continue;
        kernel.is_patient = is_patient;
        EXPECT_EQ(explore({workers, before, preemptions - kFewer, delays}), "")
            << before << ' ' << workers[0] << ' ' << is_patient;
      }
    }
  }
  kernel.is_patient = true;
}

// One takes the title while the favourite lets go, and a third one is there.
TEST(DispatchLockInterleavings, NobodyElseHasTheWordWhileATitleIsTaken) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  kernel.is_patient = false;
  EXPECT_EQ(explore({{"d", "d", "t"}, kFavourite, 3 - kFewer, 0}), "");
  kernel.is_patient = true;
}

// The tests above could not see a fault of the favourite if they did not see these.
TEST(DispatchLockInterleavings, WithoutTheKernelsBarrierTwoAreInside) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  kernel.has_barrier = false;
  EXPECT_EQ(explore({{"d", "d"}, kFavourite, 1, 1}), "two are inside");
  EXPECT_EQ(explore({{"d", "d"}, kFavourite, 2, 0}), "") << "it is needed for late stores only";
  kernel.has_barrier = true;
}

TEST(DispatchLockInterleavings, WithoutTheKernelsWakeUpAWorkerWaitsForEver) {
  if (kNoContexts != nullptr) GTEST_SKIP() << kNoContexts;
  kernel.wakes = false;
  kernel.is_patient = false;
  EXPECT_EQ(explore({{"d", "d"}, 0, 1, 0}), "a worker waits for ever");
  kernel.wakes = true;
  kernel.is_patient = true;
}

}  // namespace
}  // namespace takt_explored
