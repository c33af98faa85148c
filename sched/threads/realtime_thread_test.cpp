// Tests of threads that have their attributes before they run anything.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/realtime_thread.hpp"

#include <atomic>
#include <latch>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(RealtimeThread, RunsItsBodyInAnotherThreadAndJoinsWhenItGoes) {
  std::thread::id runner;
  {
    const RealtimeThread thread({}, Realtime::off, [&] { runner = std::this_thread::get_id(); });
  }
  EXPECT_NE(runner, std::thread::id());
  EXPECT_NE(runner, std::this_thread::get_id());
}

TEST(RealtimeThread, ReportsWhatIsInForceAsSoonAsItExists) {
  const int cpu = available_cpus().back();
  std::latch go_on(1);
  long tid = 0;
  RealtimeThread thread({.name = "control", .affinity = {cpu}}, Realtime::off, [&] {
    tid = syscall(SYS_gettid);
    go_on.wait();
  });
  EXPECT_EQ(thread.state().name, "control");
  EXPECT_THAT(thread.state().affinity, ElementsAre(cpu));
  const int reported_tid = thread.state().tid;
  go_on.count_down();
  thread.join();
  EXPECT_EQ(reported_tid, tid);
}

TEST(RealtimeThread, HasItsAttributesBeforeItsBodyBegins) {
  const int cpu = available_cpus().front();
  ThreadState seen_by_body;
  RealtimeThread thread(
      {.name = "batch", .policy = ThreadPolicy::batch, .nice = 5, .affinity = {cpu}},
      Realtime::require, [&] { seen_by_body = this_thread_state(); });
  thread.join();
  EXPECT_EQ(seen_by_body.name, "batch");
  EXPECT_EQ(seen_by_body.policy, ThreadPolicy::batch);
  EXPECT_EQ(seen_by_body.nice, 5);
  EXPECT_THAT(seen_by_body.affinity, ElementsAre(cpu));
}

TEST(RealtimeThread, ThrowsAndNeverRunsItsBodyWhenTheAttributesAreImpossible) {
  bool ran = false;
  EXPECT_THAT(
      [&] {
        RealtimeThread({.name = "control", .priority = 5}, Realtime::prefer, [&] { ran = true; });
      },
      ThrowsMessage<Error>(HasSubstr("priority 5 means nothing for SCHED_OTHER")));
  EXPECT_FALSE(ran);
}

TEST(RealtimeThread, MayBeJoinedTwice) {
  std::atomic<int> runs{0};
  RealtimeThread thread({}, Realtime::off, [&] { runs.fetch_add(1); });
  thread.join();
  thread.join();
  EXPECT_EQ(runs, 1);
}

TEST(RealtimeThread, RunsUnderARealTimePolicyIfTheUserMay) {
  ThreadState seen_by_body;
  RealtimeThread thread({.name = "fast", .policy = ThreadPolicy::fifo, .priority = 12},
                        Realtime::prefer, [&] { seen_by_body = this_thread_state(); });
  thread.join();
  if (!thread.state().refused.empty()) GTEST_SKIP() << thread.state().refused;
  EXPECT_EQ(seen_by_body.policy, ThreadPolicy::fifo);
  EXPECT_EQ(seen_by_body.priority, 12);
  EXPECT_EQ(thread.state().policy, ThreadPolicy::fifo);
}

}  // namespace
}  // namespace takt
