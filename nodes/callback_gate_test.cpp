// Tests of the gate: what may pass, and what closing waits for.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/callback_gate.hpp"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/entities/callback_list.hpp"
#include "takt/testing/eventually.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

TEST(CallbackGate, BeginsClosed) {
  CallbackGate gate;
  EXPECT_FALSE(gate.is_open());
  EXPECT_TRUE(gate.is_closed());
  EXPECT_FALSE(gate.reserve());
  EXPECT_EQ(gate.closings(), 1u);
}

TEST(CallbackGate, LetsThroughWhileOpen) {
  CallbackGate gate;
  gate.open();
  for (int i = 0; i < 100'000; ++i) {  // more than a counter of 15 bits would bear
    ASSERT_TRUE(gate.reserve());
    if (i % 2 == 0) {
      gate.give_back();
    } else {
      const CallbackGate::Passage passage(gate);
      ASSERT_TRUE(passage);
    }
  }
  gate.close();
  EXPECT_FALSE(gate.reserve());
  EXPECT_EQ(gate.closings(), 2u);
}

TEST(CallbackGate, ClosingWaitsForACallbackThatRuns) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> is_inside{false}, has_ended{false};
  std::thread worker([&] {
    ASSERT_TRUE(gate.reserve());
    const CallbackGate::Passage passage(gate);
    is_inside = true;
    is_inside.notify_all();
    std::this_thread::sleep_for(20ms);
    EXPECT_FALSE(gate.is_open());
    EXPECT_FALSE(gate.is_closed());
    has_ended = true;
  });
  is_inside.wait(false);
  gate.close();
  EXPECT_TRUE(has_ended);
  EXPECT_TRUE(gate.is_closed());
  worker.join();
}

// What was taken has left its ring: it must run, or it would be lost.
TEST(CallbackGate, ClosingWaitsForWhatWasTakenOnAnotherThread) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> has_reserved{false}, has_run{false};
  std::thread worker([&] {
    ASSERT_TRUE(gate.reserve());
    has_reserved = true;
    has_reserved.notify_all();
    std::this_thread::sleep_for(20ms);
    const CallbackGate::Passage passage(gate);
    EXPECT_TRUE(passage);
    has_run = true;
  });
  has_reserved.wait(false);
  gate.close();
  EXPECT_TRUE(has_run);
  worker.join();
}

TEST(CallbackGate, ACallbackThatClosesIsNotWaitedForNorAreThoseAroundIt) {
  CallbackGate gate, other;
  gate.open();
  other.open();
  ASSERT_TRUE(gate.reserve());
  {
    const CallbackGate::Passage outer(gate);
    ASSERT_TRUE(other.reserve());
    const CallbackGate::Passage elsewhere(other);
    ASSERT_TRUE(gate.reserve());
    const CallbackGate::Passage inner(gate);
    gate.close();
    EXPECT_TRUE(gate.is_closed());
    EXPECT_TRUE(other.is_open());
  }
  gate.open();
  other.close();
  EXPECT_TRUE(gate.reserve());
  gate.give_back();
}

// Two nodes whose callbacks deactivated each other waited for ever.
TEST(CallbackGate, CallbacksThatCloseEachOthersGatesDoNotWaitForEver) {
  CallbackGate first, second;
  first.open();
  second.open();
  std::atomic<int> in{0}, closed{0};
  const auto close_other = [&](CallbackGate& own, CallbackGate& other) {
    ASSERT_TRUE(own.reserve());
    const CallbackGate::Passage passage(own);
    in.fetch_add(1);
    in.notify_all();
    for (int now; (now = in.load()) < 2;) in.wait(now);
    other.close();
    EXPECT_TRUE(other.is_closed());
    closed.fetch_add(1);
  };
  std::thread worker([&] { close_other(first, second); });
  std::thread another([&] { close_other(second, first); });
  if (!eventually([&] { return closed.load() == 2; })) std::abort();
  worker.join();
  another.join();
}

// One closes the gate of the other, which removes what the first one runs.
TEST(CallbackGate, ClosingIsOneOfAllWaitsThatMayWaitForEachOther) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> is_inside{false}, is_called{false}, has_closed{false};
  detail::CallbackList<void()> list;
  const auto entry = list.add([&] {
    is_called.store(true);
    is_inside.wait(false);
    gate.close();
    has_closed.store(true);
  });
  std::thread worker([&] {
    ASSERT_TRUE(gate.reserve());
    const CallbackGate::Passage passage(gate);
    is_inside.store(true);
    is_inside.notify_all();
    EXPECT_TRUE(eventually([&] { return is_called.load() && !gate.is_open(); }));
    entry->remove();
  });
  std::thread closer([&] {
    list.each(detail::CallbackList<void()>::Order::first_added, [](const auto& function) {
      function();
      return true;
    });
  });
  if (!eventually([&] { return has_closed.load(); })) std::abort();
  worker.join();
  closer.join();
}

// Logical execution time: a thread has taken the inputs of a period, and a callback of it waits for
// the thread that closes.
TEST(CallbackGate, InputsOfAPeriodThatWaitsAreNotWaitedFor) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> is_taken{false}, is_called{false}, has_closed{false};
  detail::CallbackList<void()> list;
  const auto entry = list.add([&] {
    is_called.store(true);
    gate.close();
    has_closed.store(true);
  });
  std::thread worker([&] {
    ASSERT_TRUE(gate.reserve());
    const CallbackGate::Period period;
    is_taken.store(true);
    EXPECT_TRUE(eventually([&] { return is_called.load() && !gate.is_open(); }));
    entry->remove();
    const CallbackGate::Passage passage(gate);
    EXPECT_FALSE(passage);
  });
  ASSERT_TRUE(eventually([&] { return is_taken.load(); }));
  std::thread closer([&] {
    list.each(detail::CallbackList<void()>::Order::first_added, [](const auto& function) {
      function();
      return true;
    });
  });
  if (!eventually([&] { return has_closed.load(); })) std::abort();
  worker.join();
  closer.join();
}

// A callback that closes its own gate waits for the others.
TEST(CallbackGate, ACallbackThatClosesItsGateWaitsForThoseOfOtherThreads) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> is_inside{false}, has_ended{false};
  std::thread worker([&] {
    ASSERT_TRUE(gate.reserve());
    const CallbackGate::Passage passage(gate);
    is_inside.store(true);
    is_inside.notify_all();
    EXPECT_TRUE(eventually([&] { return !gate.is_open(); }));
    EXPECT_FALSE(gate.is_closed());
    has_ended.store(true);
  });
  is_inside.wait(false);
  ASSERT_TRUE(gate.reserve());
  {
    const CallbackGate::Passage passage(gate);
    gate.close();
    EXPECT_TRUE(has_ended.load());
  }
  worker.join();
}

// Logical execution time: the inputs of all callbacks are taken before the first runs.
TEST(CallbackGate, WhatTheClosingThreadItselfHasTakenDoesNotRun) {
  CallbackGate gate;
  gate.open();
  ASSERT_TRUE(gate.reserve());
  ASSERT_TRUE(gate.reserve());
  ASSERT_TRUE(gate.reserve());
  {
    const CallbackGate::Passage first(gate);
    ASSERT_TRUE(first);
    gate.close();
  }
  {
    const CallbackGate::Passage second(gate);
    EXPECT_FALSE(second);
  }
  gate.give_back();
  gate.open();
  gate.close();  // nothing is left to wait for
}

TEST(CallbackGate, NobodyIsInsideAClosedGateHoweverManyTry) {
  CallbackGate gate;
  gate.open();
  std::atomic<bool> stop{false};
  std::atomic<int> inside{0};
  std::atomic<std::uint64_t> passed{0};
  std::vector<std::thread> workers;
  for (int i = 0; i < 3; ++i) {
    workers.emplace_back([&] {
      while (!stop) {
        if (!gate.reserve()) continue;
        const CallbackGate::Passage passage(gate);
        ASSERT_TRUE(passage);
        ++inside;
        ++passed;
        --inside;
      }
    });
  }
  EXPECT_TRUE(eventually([&] { return passed > 0; }));  // all are under way
  for (int round = 0; round < 300; ++round) {
    gate.close();
    ASSERT_EQ(inside, 0);
    const std::uint64_t before = passed;
    std::this_thread::yield();
    ASSERT_EQ(passed, before);
    gate.open();
  }
  stop = true;
  for (auto& worker : workers) worker.join();
}

}  // namespace
}  // namespace takt
