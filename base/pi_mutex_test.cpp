// Tests of the mutex with priority inheritance.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/pi_mutex.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <latch>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace takt {
namespace {

bool become_fifo(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return sched_setscheduler(0, SCHED_FIFO, &parameters) == 0;
}

// The priority that the kernel uses now, inheritance included: -1 - priority for real-time
// threads (proc(5), field 18 of stat; the name in parentheses may contain blanks).
long kernel_priority_of_this_thread() {
  std::ifstream stat("/proc/self/task/" + std::to_string(syscall(SYS_gettid)) + "/stat");
  std::string text;
  std::getline(stat, text);
  std::istringstream rest(text.substr(text.rfind(')') + 1));
  std::string skipped;
  for (int field = 3; field < 18; ++field) rest >> skipped;
  long priority = 0;
  rest >> priority;
  return priority;
}

TEST(PiMutex, IsFreeUntilItIsLockedAndAfterItIsUnlocked) {
  PiMutex mutex;
  const auto is_free = [&] {
    bool free = false;
    std::thread([&] {
      free = mutex.try_lock();
      if (free) mutex.unlock();
    }).join();
    return free;
  };
  EXPECT_TRUE(is_free());
  mutex.lock();
  EXPECT_FALSE(is_free());
  mutex.unlock();
  EXPECT_TRUE(is_free());
}

TEST(PiMutex, LetsOneThreadInAtATime) {
  constexpr int kThreads = 4;
  constexpr int kRounds = 5000;
  PiMutex mutex;
  long count = 0;  // not atomic: the mutex is what protects it
  std::latch start(kThreads);
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      start.arrive_and_wait();
      for (int round = 0; round < kRounds; ++round) {
        const std::lock_guard lock(mutex);
        ++count;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(count, kThreads * kRounds);
}

TEST(PiMutex, LendsTheHolderThePriorityOfItsWaiter) {
  PiMutex mutex;
  std::latch locked(1);
  bool granted = false;
  bool was_lent = false;
  std::thread holder([&] {
    granted = become_fifo(10);
    mutex.lock();
    locked.count_down();
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (granted && !was_lent && std::chrono::steady_clock::now() < give_up) {
      was_lent = kernel_priority_of_this_thread() == -1 - 20;
      sched_yield();
    }
    mutex.unlock();
  });
  std::thread waiter([&] {
    locked.wait();
    become_fifo(20);
    const std::lock_guard lock(mutex);
  });
  holder.join();
  waiter.join();
  if (!granted) GTEST_SKIP() << "SCHED_FIFO was refused: " << std::strerror(EPERM);
  EXPECT_TRUE(was_lent);
}

#ifdef TAKT_CHECK_LOCKS
TEST(PiMutexDeathTest, IsTakenInTheOrderOfLocks) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  RankedMutex<LockRank::callback_lists> outer;
  RankedMutex<LockRank::node> inner;
  PiMutex last, other;
  {
    const std::lock_guard one(outer);
    const std::lock_guard two(inner);
    const std::lock_guard three(last);
  }
  outer.lock();
  inner.lock();
  outer.unlock();  // not the last one
  EXPECT_DEATH(outer.lock(), "'callback_lists' is wanted while 'node' is held");
  EXPECT_DEATH(outer.try_lock(), "'callback_lists' is wanted while 'node' is held");
  inner.unlock();
  const auto both = [&] {
    const std::lock_guard one(last);
    const std::lock_guard two(other);
  };
  EXPECT_DEATH(both(), "'leaf' is wanted while 'leaf' is held");
}
#endif

}  // namespace
}  // namespace takt
