// Tests of the clock that a test moves.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/manual_clock.hpp"

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

constexpr TimePoint kStart{};

// A thread that takes part in the clock and leaves it when its body ends. The trace needs no lock:
// the clock lets one thread run at a time, and the thread sanitizer checks that it does.
class Worker {
 public:
  using Body = std::function<void(ManualClock::Participant&)>;

  Worker(ManualClock& clock, std::uint64_t rank, Body body)
      : thread_([this, &clock, rank, body = std::move(body)] {
          participant.rank = {rank, 0};
          clock.join(participant);
          body(participant);
          clock.leave(participant);
        }) {}
  ~Worker() { thread_.join(); }

  ManualClock::Participant participant;

 private:
  std::thread thread_;
};

class ManualClockTest : public testing::Test {
 protected:
  void note(const std::string& what) {
    const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(clock_.now() - kStart);
    trace_.push_back(std::to_string(now.count()) + " " + what);
  }

  ManualClock clock_;
  std::vector<std::string> trace_;
};

TEST_F(ManualClockTest, StandsStillUntilItIsMoved) {
  EXPECT_EQ(clock_.now(), kStart);
  clock_.advance(5ms);
  EXPECT_EQ(clock_.now(), kStart + 5ms);
  clock_.settle();
  EXPECT_EQ(clock_.now(), kStart + 5ms);
  ManualClock later(kStart + 1h);
  EXPECT_EQ(later.now(), kStart + 1h);
}

TEST_F(ManualClockTest, MovesByTheWorkOfAThreadThatDoesNotTakePart) {
  clock_.work(3ms);
  EXPECT_EQ(clock_.now(), kStart + 3ms);
}

TEST_F(ManualClockTest, RunsNobodyBeforeItIsMoved) {
  Worker worker(clock_, 0, [&](auto&) { note("ran"); });
  clock_.wait_for_participants(1);
  EXPECT_TRUE(trace_.empty());
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("0 ran"));
}

TEST_F(ManualClockTest, InterleavesTwoWorkersByTheirWakeUpTimes) {
  const auto every = [this](const char* name, Nanoseconds period) {
    return [this, name, period](ManualClock::Participant& self) {
      for (int i = 1; i <= 3; ++i) {
        EXPECT_FALSE(clock_.wait(self, kStart + i * period));
        note(name);
      }
    };
  };
  Worker slow(clock_, 1, every("slow", 30ms));
  Worker fast(clock_, 2, every("fast", 20ms));
  clock_.wait_for_participants(2);
  clock_.advance(45ms);
  EXPECT_THAT(trace_, ElementsAre("20 fast", "30 slow", "40 fast"));
  EXPECT_EQ(clock_.now(), kStart + 45ms);
  clock_.advance(45ms);
  // At 60 both are due: the smaller rank first.
  EXPECT_THAT(trace_,
              ElementsAre("20 fast", "30 slow", "40 fast", "60 slow", "60 fast", "90 slow"));
}

TEST_F(ManualClockTest, RunsTheSmallerRankFirstWhoeverJoinedFirst) {
  const auto once = [this](const char* name) {
    return [this, name](ManualClock::Participant&) { note(name); };
  };
  Worker third(clock_, 3, once("third"));
  clock_.wait_for_participants(1);
  Worker first(clock_, 1, once("first"));
  clock_.wait_for_participants(2);
  Worker second(clock_, 2, once("second"));
  clock_.wait_for_participants(3);
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("0 first", "0 second", "0 third"));
}

TEST_F(ManualClockTest, LetsOthersRunWhileOneWorks) {
  Worker busy(clock_, 1, [&](auto&) {
    note("busy begins");
    clock_.work(10ms);
    note("busy ends");
  });
  Worker timer(clock_, 2, [&](ManualClock::Participant& self) {
    clock_.wait(self, kStart + 4ms);
    note("timer");
  });
  clock_.wait_for_participants(2);
  clock_.advance(20ms);
  EXPECT_THAT(trace_, ElementsAre("0 busy begins", "4 timer", "10 busy ends"));
}

TEST_F(ManualClockTest, WakesAWaiterBeforeItsDeadline) {
  bool was_woken = false;
  Worker waiter(clock_, 1, [&](ManualClock::Participant& self) {
    was_woken = clock_.wait(self, kStart + 100ms);
    note("woken");
  });
  clock_.wait_for_participants(1);
  clock_.advance(10ms);
  EXPECT_TRUE(trace_.empty());
  clock_.wake(waiter.participant);
  EXPECT_TRUE(trace_.empty());
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("10 woken"));
  EXPECT_TRUE(was_woken);
}

TEST_F(ManualClockTest, WakesAWaiterThatHasNoDeadline) {
  Worker waiter(clock_, 1, [&](ManualClock::Participant& self) {
    EXPECT_TRUE(clock_.wait(self, kNever));
    note("woken");
  });
  Worker waker(clock_, 2, [&](ManualClock::Participant& self) {
    clock_.wait(self, kStart + 7ms);
    note("wakes");
    clock_.wake(waiter.participant);
    note("goes on");
  });
  clock_.wait_for_participants(2);
  clock_.advance(1h);
  EXPECT_THAT(trace_, ElementsAre("7 wakes", "7 goes on", "7 woken"));
}

TEST_F(ManualClockTest, KeepsAWakeUpThatComesBeforeTheWaitAndGivesItOnce) {
  Worker waiter(clock_, 1, [&](ManualClock::Participant& self) {
    clock_.wake(self);
    clock_.wake(self);
    EXPECT_TRUE(clock_.wait(self, kStart + 5ms));
    note("first");
    EXPECT_FALSE(clock_.wait(self, kStart + 5ms));
    note("second");
  });
  clock_.wait_for_participants(1);
  clock_.advance(10ms);
  EXPECT_THAT(trace_, ElementsAre("0 first", "5 second"));
}

TEST_F(ManualClockTest, DoesNotCutWorkShortForAWakeUp) {
  Worker busy(clock_, 1, [&](ManualClock::Participant& self) {
    clock_.work(10ms);
    note("done");
    EXPECT_TRUE(clock_.wait(self, kNever));
    note("woken");
  });
  clock_.wait_for_participants(1);
  clock_.advance(5ms);
  clock_.wake(busy.participant);
  clock_.settle();
  EXPECT_TRUE(trace_.empty());
  clock_.advance(10ms);
  EXPECT_THAT(trace_, ElementsAre("10 done", "10 woken"));
}

TEST_F(ManualClockTest, StopsInTheMiddleOfAnAdvance) {
  std::atomic<bool> stops{false};
  Worker worker(clock_, 1, [&](ManualClock::Participant& self) {
    for (int i = 1; i <= 5; ++i) {
      clock_.wait(self, kStart + i * 1ms);
      stops = i == 3;
    }
  });
  clock_.wait_for_participants(1);
  clock_.advance(1h, &stops);
  EXPECT_EQ(clock_.now(), kStart + 3ms);
  clock_.advance(1h);
  EXPECT_EQ(clock_.now(), kStart + 1h + 3ms);
}

TEST_F(ManualClockTest, DoesNotWaitForADeadlineThatHasPassed) {
  Worker worker(clock_, 1, [&](ManualClock::Participant& self) {
    EXPECT_FALSE(clock_.wait(self, kStart));
    EXPECT_FALSE(clock_.wait(self, kStart - 1ms));
    note("ran");
  });
  clock_.wait_for_participants(1);
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("0 ran"));
}

TEST_F(ManualClockTest, GivesTheSameTraceOnEveryRun) {
  const auto run = [] {
    ManualClock clock;
    std::vector<int> trace;
    const auto work = [&](int id) {
      return [&, id](ManualClock::Participant& self) {
        for (int i = 1; i <= 20; ++i) {
          clock.wait(self, kStart + i * (id + 2) * 1ms);
          trace.push_back(id);
          clock.work((id * 7 + i) % 5 * 1ms);
          trace.push_back(-id);
        }
      };
    };
    Worker first(clock, 1, work(1));
    Worker second(clock, 2, work(2));
    Worker third(clock, 3, work(3));
    clock.wait_for_participants(3);
    clock.advance(1s);
    return trace;
  };
  const std::vector<int> trace = run();
  EXPECT_EQ(trace.size(), 120u);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(run(), trace);
}

}  // namespace
}  // namespace takt
