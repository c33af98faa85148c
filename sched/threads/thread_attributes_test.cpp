// Tests of the Linux attributes of threads, granted and refused.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/thread_attributes.hpp"

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/sched/threads/realtime_thread.hpp"
#include "takt/testing/child_process.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;

// In a thread of its own, so that nothing of it stays with the test program.
ThreadState applied(const ThreadAttributes& attributes, Realtime realtime) {
  ThreadState state;
  std::thread([&] { state = apply(attributes, realtime); }).join();
  return state;
}

bool fifo_is_granted() {
  bool granted = false;
  std::thread([&] {
    sched_param parameters{};
    parameters.sched_priority = 10;
    granted = sched_setscheduler(0, SCHED_FIFO, &parameters) == 0;
  }).join();
  return granted;
}
constexpr const char* kNoRights = "this user may not use SCHED_FIFO: no CAP_SYS_NICE and no rtprio";

// 2 ms of every 10.
ThreadAttributes reservation(const std::string& name = "reserved") {
  return {.name = name, .policy = ThreadPolicy::deadline, .runtime = 2ms, .period = 10ms};
}

// ---- Names ----

TEST(ThreadPolicy, HasTheNamesOfTheManual) {
  for (const ThreadPolicy policy :
       {ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr, ThreadPolicy::batch,
        ThreadPolicy::idle, ThreadPolicy::deadline}) {
    EXPECT_EQ(thread_policy(to_string(policy)), policy);
  }
  EXPECT_EQ(to_string(ThreadPolicy::fifo), "SCHED_FIFO");
}

TEST(ThreadPolicy, AnswersAnUnknownNameWithTheValidOnes) {
  EXPECT_THAT([] { thread_policy("SCHED_FIFA"); },
              ThrowsMessage<Error>("there is no thread policy 'SCHED_FIFA'; did you mean "
                                   "'SCHED_FIFO'? valid: SCHED_OTHER, SCHED_FIFO, SCHED_RR, "
                                   "SCHED_BATCH, SCHED_IDLE, SCHED_DEADLINE"));
}

// ---- What can never work ----

struct Impossible {
  ThreadAttributes attributes;
  const char* message;
};
class ImpossibleAttributes : public testing::TestWithParam<Impossible> {};

TEST_P(ImpossibleAttributes, AreRefusedWithTheReasonAndTheRemedyWhateverRealtimeSays) {
  const Impossible& impossible = GetParam();
  EXPECT_THAT([&] { impossible.attributes.check(); }, ThrowsMessage<Error>(impossible.message));
  for (const Realtime realtime : {Realtime::off, Realtime::prefer, Realtime::require}) {
    EXPECT_THAT([&] { apply(impossible.attributes, realtime); },
                ThrowsMessage<Error>(impossible.message));
  }
}

INSTANTIATE_TEST_SUITE_P(
    ThreadAttributes, ImpossibleAttributes,
    testing::Values(
        Impossible{{.policy = ThreadPolicy::fifo, .priority = 0},
                   "priority 0 does not exist for SCHED_FIFO; choose 1 to 99"},
        Impossible{{.policy = ThreadPolicy::rr, .priority = 100},
                   "priority 100 does not exist for SCHED_RR; choose 1 to 99"},
        Impossible{{.policy = ThreadPolicy::other, .priority = 80},
                   "priority 80 means nothing for SCHED_OTHER; leave it out, or choose SCHED_FIFO "
                   "or SCHED_RR"},
        Impossible{{.policy = ThreadPolicy::fifo, .priority = 5, .nice = 3},
                   "nice 3 means nothing for SCHED_FIFO; leave it out, or choose SCHED_OTHER or "
                   "SCHED_BATCH"},
        Impossible{{.nice = 20}, "nice 20 does not exist; choose -20 to 19"},
        Impossible{{.nice = -21}, "nice -21 does not exist; choose -20 to 19"},
        Impossible{{.policy = ThreadPolicy::deadline, .priority = 5},
                   "priority 5 means nothing for SCHED_DEADLINE; leave it out, or choose "
                   "SCHED_FIFO or SCHED_RR"},
        Impossible{{.policy = ThreadPolicy::deadline, .nice = 3},
                   "nice 3 means nothing for SCHED_DEADLINE; leave it out, or choose SCHED_OTHER "
                   "or SCHED_BATCH"},
        Impossible{{.policy = ThreadPolicy::deadline, .period = 10ms},
                   "SCHED_DEADLINE needs a runtime and a period; give both, such as 2ms and 10ms"},
        Impossible{{.policy = ThreadPolicy::deadline, .runtime = 2ms, .deadline = 5ms},
                   "SCHED_DEADLINE needs a runtime and a period; give both, such as 2ms and 10ms"},
        Impossible{{.policy = ThreadPolicy::deadline, .runtime = 1us, .period = 10ms},
                   "runtime 0.001ms is too short; give at least 1024ns"},
        Impossible{{.policy = ThreadPolicy::deadline, .runtime = 10us, .period = 90us},
                   "Linux refuses a period of 0.09ms; give one from 0.1ms to 4194.304ms, or set "
                   "kernel.sched_deadline_period_min_us"},
        Impossible{{.policy = ThreadPolicy::deadline, .runtime = 2ms, .period = 5s},
                   "Linux refuses a period of 5000ms; give one from 0.1ms to 4194.304ms, or set "
                   "kernel.sched_deadline_period_max_us"},
        Impossible{{.policy = ThreadPolicy::deadline, .runtime = 12ms, .period = 10ms},
                   "runtime 12ms is longer than period 10ms; shorten the runtime"},
        Impossible{
            {.policy = ThreadPolicy::deadline, .runtime = 2ms, .deadline = 1ms, .period = 10ms},
            "runtime 2ms is longer than deadline 1ms; shorten the runtime"},
        Impossible{
            {.policy = ThreadPolicy::deadline, .runtime = 2ms, .deadline = 20ms, .period = 10ms},
            "deadline 20ms is longer than period 10ms; shorten the deadline, or leave it out: it "
            "is the period then"},
        Impossible{
            {.policy = ThreadPolicy::deadline, .affinity = {0}, .runtime = 2ms, .period = 10ms},
            "the kernel refuses SCHED_DEADLINE to a thread with an affinity; leave it out, or run "
            "the process in an exclusive cpuset of these CPUs"},
        Impossible{{.policy = ThreadPolicy::fifo, .priority = 5, .period = 10ms},
                   "runtime, deadline and period mean nothing for SCHED_FIFO; leave them out, or "
                   "choose SCHED_DEADLINE"}));

TEST(ThreadAttributes, NameACpuThatIsNotThereAndThoseThatAre) {
  const ThreadAttributes attributes{.affinity = {CPU_SETSIZE - 1}};
  EXPECT_THAT([&] { attributes.check(); },
              ThrowsMessage<Error>(AllOf(StartsWith("there is no CPU 1023 here; choose from "),
                                         HasSubstr(std::to_string(available_cpus()[0])))));
  EXPECT_NO_THROW(ThreadAttributes{.affinity = available_cpus()}.check());
}

// A CPU that is isolated, or that taskset leaves out, is in no mask that a process is started with.
TEST(ThreadAttributes, NameEachCpuThatAThreadMayBeMovedTo) {
  const std::vector<int>& usable = usable_cpus();
  EXPECT_TRUE(std::is_sorted(usable.begin(), usable.end()));
  EXPECT_TRUE(std::includes(usable.begin(), usable.end(), available_cpus().begin(),
                            available_cpus().end()));
  EXPECT_NO_THROW(ThreadAttributes{.affinity = usable}.check());
  ThreadState state{.name = "control", .affinity = available_cpus()};
  EXPECT_EQ(cpus_outside(state), "");
  state.affinity.push_back(CPU_SETSIZE);
  EXPECT_THAT(cpus_outside(state), StartsWith("thread 'control' runs on CPU 1024, as its affinity "
                                              "says; this process was started on CPU "));
}

// ---- What is granted ----

TEST(ThreadAttributes, ReportWhatTheThreadHas) {
  ThreadState state;
  long tid = 0;
  std::thread([&] {
    tid = syscall(SYS_gettid);
    state = this_thread_state();
  }).join();
  EXPECT_EQ(state.tid, tid);
  EXPECT_EQ(state.policy, ThreadPolicy::other);
  EXPECT_EQ(state.priority, 0);
  EXPECT_EQ(state.affinity, available_cpus());
  EXPECT_TRUE(state.refused.empty());
}

TEST(ThreadAttributes, GiveTheThreadANameOfFifteenCharacters) {
  EXPECT_EQ(applied({.name = "control"}, Realtime::off).name, "control");
  EXPECT_EQ(applied({.name = "perception_front"}, Realtime::off).name, "perception_fron");
}

TEST(ThreadAttributes, PutTheThreadOnItsCpus) {
  const int last = available_cpus().back();
  for (const Realtime realtime : {Realtime::off, Realtime::prefer, Realtime::require}) {
    EXPECT_THAT(applied({.affinity = {last}}, realtime).affinity, ElementsAre(last));
  }
}

TEST(ThreadAttributes, ApplyPolicyAndPriority) {
  if (!fifo_is_granted()) GTEST_SKIP() << kNoRights;
  ThreadState state = applied({.policy = ThreadPolicy::fifo, .priority = 7}, Realtime::require);
  EXPECT_EQ(state.policy, ThreadPolicy::fifo);
  EXPECT_EQ(state.priority, 7);
  EXPECT_TRUE(state.refused.empty());
  state = applied({.policy = ThreadPolicy::rr, .priority = 3}, Realtime::prefer);
  EXPECT_EQ(state.policy, ThreadPolicy::rr);
  EXPECT_EQ(state.priority, 3);
}

TEST(ThreadAttributes, ApplyPoliciesThatNeedNoRights) {
  EXPECT_EQ(applied({.policy = ThreadPolicy::batch}, Realtime::require).policy,
            ThreadPolicy::batch);
  EXPECT_EQ(applied({.policy = ThreadPolicy::idle}, Realtime::require).policy, ThreadPolicy::idle);
}

TEST(ThreadAttributes, ApplyTheNiceValueToTheThreadAlone) {
  const int before = this_thread_state().nice;
  EXPECT_EQ(applied({.nice = 19}, Realtime::require).nice, 19);
  EXPECT_EQ(this_thread_state().nice, before);
}

TEST(ThreadAttributes, AskForNoPolicyWhenRealtimeIsOff) {
  const ThreadState state = applied({.policy = ThreadPolicy::fifo, .priority = 7}, Realtime::off);
  EXPECT_EQ(state.policy, ThreadPolicy::other);
  EXPECT_EQ(state.priority, 0);
  EXPECT_TRUE(state.refused.empty());
}

TEST(ThreadAttributes, ReserveATimeOfEveryPeriod) {
  ThreadState state = applied(reservation(), Realtime::prefer);
  if (!state.refused.empty()) GTEST_SKIP() << state.refused;
  EXPECT_EQ(state.policy, ThreadPolicy::deadline);
  EXPECT_EQ(state.runtime, 2ms);
  EXPECT_EQ(state.deadline, 10ms);  // when nothing is said of it
  EXPECT_EQ(state.period, 10ms);
  EXPECT_EQ(state.priority, 0);
  EXPECT_EQ(state.affinity, available_cpus());
  ThreadAttributes early = reservation();
  early.deadline = 4ms;
  state = applied(early, Realtime::prefer);
  if (!state.refused.empty()) GTEST_SKIP() << state.refused;
  EXPECT_EQ(state.deadline, 4ms);
  EXPECT_EQ(state.period, 10ms);
}

TEST(ThreadAttributes, ReportNoReservationWhereThereIsNone) {
  const ThreadState state = this_thread_state();
  EXPECT_EQ(state.runtime, 0ns);
  EXPECT_EQ(state.deadline, 0ns);
  EXPECT_EQ(state.period, 0ns);
}

// Without the flag for it the kernel would refuse the new thread: EAGAIN.
TEST(ThreadAttributes, LetAThreadWithAReservationStartOthersWithoutOne) {
  ThreadState parent, child;
  std::thread([&] {
    parent = apply(reservation(), Realtime::prefer);
    std::thread([&] { child = this_thread_state(); }).join();
  }).join();
  if (!parent.refused.empty()) GTEST_SKIP() << parent.refused;
  EXPECT_EQ(parent.policy, ThreadPolicy::deadline);
  EXPECT_EQ(child.policy, ThreadPolicy::other);
}

// ---- Admission ----

TEST(Admission, CountsEachReservationAgainstTheLimit) {
  std::vector<ThreadAttributes> threads(9, reservation());
  threads.push_back({.policy = ThreadPolicy::fifo, .priority = 80});
  EXPECT_NO_THROW(check_admission({}, 0));
  EXPECT_NO_THROW(check_admission(threads, 1.9));
  threads.push_back(reservation());
  EXPECT_THAT([&] { check_admission(threads, 1.9); },
              ThrowsMessage<Error>(
                  "SCHED_DEADLINE threads reserve 2 CPUs, of 1.9 that there are for them; shorten "
                  "runtimes, lengthen periods, or raise kernel.sched_rt_runtime_us"));
}

TEST(Admission, TakesASumThatIsTheLimitWhateverRoundingMakesOfIt) {
  const std::vector<ThreadAttributes> threads(
      19, {.policy = ThreadPolicy::deadline, .runtime = 1ms, .period = 10ms});
  EXPECT_NO_THROW(check_admission(threads, 1.9));
}

TEST(Admission, NeverGivesMoreThanTheCpusOfThisProcess) {
  const ThreadAttributes whole{.policy = ThreadPolicy::deadline, .runtime = 9ms, .period = 9ms};
  const std::vector<ThreadAttributes> threads(available_cpus().size() + 1, whole);
  EXPECT_THROW(check_admission(threads), Error);
}

// Threads of 0.9 CPU each, until the kernel refuses one; what that has then.
ThreadState one_too_many(Realtime realtime) {
  ThreadAttributes greedy = reservation("greedy");
  greedy.runtime = 9ms;
  std::vector<std::unique_ptr<RealtimeThread>> threads;
  std::promise<void> wanted;  // abandoned before the threads are joined
  const std::shared_future<void> unwanted = wanted.get_future().share();
  for (std::size_t i = 0; i <= 2 * available_cpus().size(); ++i) {
    threads.push_back(std::make_unique<RealtimeThread>(greedy, realtime, [=] { unwanted.wait(); }));
    if (!threads.back()->state().refused.empty()) break;
  }
  return threads.back()->state();
}

TEST(Admission, IsTheKernelsInTheEnd) {
  const std::string refused = applied(reservation(), Realtime::prefer).refused;
  if (!refused.empty()) GTEST_SKIP() << refused;
  const ThreadState state = one_too_many(Realtime::prefer);
  if (state.refused.empty()) GTEST_SKIP() << "no limit: kernel.sched_rt_runtime_us is -1";
  EXPECT_EQ(state.policy, ThreadPolicy::other);
  EXPECT_THAT(state.refused, StartsWith("SCHED_DEADLINE 9ms/10ms: Device or resource busy "
                                        "(with what other threads and processes have"));
  EXPECT_THAT([&] { one_too_many(Realtime::require); },
              ThrowsMessage<Error>(
                  AllOf(StartsWith("thread 'greedy' was refused SCHED_DEADLINE 9ms/10ms: Device or "
                                   "resource busy"),
                        HasSubstr("write `realtime: prefer` to go on without"))));
}

// ---- What is refused ----

// The kernel refuses it to a thread that may not use all CPUs.
TEST(ThreadAttributes, GiveAReservationToAThreadWhoseMakerHasFewerCpus) {
  if (available_cpus().size() < 2) GTEST_SKIP() << "there is but one CPU";
  if (applied(reservation(), Realtime::prefer).policy != ThreadPolicy::deadline) {
    GTEST_SKIP() << "this user may not use SCHED_DEADLINE";
  }
  ThreadState state;
  std::thread([&] {
    apply({.affinity = {available_cpus().back()}}, Realtime::require);
    state = apply(reservation(), Realtime::prefer);
  }).join();
  EXPECT_EQ(state.policy, ThreadPolicy::deadline);
  EXPECT_EQ(state.refused, "");
}

TEST(ThreadAttributes, RecordARefusedReservationWithTheRightThatIsMissing) {
  const std::string text =
      in_child(Rights::none, [] { return apply(reservation(), Realtime::prefer).refused; });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("SCHED_DEADLINE 2ms/10ms: Operation not permitted (it takes "
                               "CAP_SYS_NICE, no rtprio is enough"));
}

TEST(ThreadAttributes, ThrowWhenRequiredAndRefused) {
  const std::string text = in_child(Rights::none, [] {
    try {
      apply({.name = "control", .policy = ThreadPolicy::fifo, .priority = 80}, Realtime::require);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("thread 'control' was refused SCHED_FIFO 80: Operation not "
                               "permitted (RLIMIT_RTPRIO is 0; give the user rtprio in "
                               "/etc/security/limits.conf"));
  EXPECT_THAT(text, HasSubstr("grant it, or write `realtime: prefer` to go on without"));
}

TEST(ThreadAttributes, RecordWhatWasRefusedWhenPreferred) {
  const std::string text = in_child(Rights::none, [] {
    const ThreadState state = apply({.name = "control",
                                     .policy = ThreadPolicy::rr,
                                     .priority = 5,
                                     .affinity = {available_cpus().back()}},
                                    Realtime::prefer);
    return state.name + " " + std::string(to_string(state.policy)) + " on " +
           std::to_string(state.affinity.size()) + ": " + state.refused;
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("control SCHED_OTHER on 1: SCHED_RR 5: Operation not permitted"));
  EXPECT_THAT(text, Not(HasSubstr("affinity")));
}

// Linux ended the whole process, by SIGXCPU, when a thread had run so long without sleeping.
TEST(ThreadAttributes, GiveNoPriorityWhereALimitWouldEndTheProcess) {
  if (!fifo_is_granted()) GTEST_SKIP() << kNoRights;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_RTTIME, &before), 0);
  rlimit limited = before;
  limited.rlim_cur = 60'000'000;
  ASSERT_EQ(setrlimit(RLIMIT_RTTIME, &limited), 0);
  const ThreadAttributes urgent{.name = "urgent", .policy = ThreadPolicy::fifo, .priority = 10};
  const ThreadState state = applied(urgent, Realtime::prefer);
  ASSERT_EQ(setrlimit(RLIMIT_RTTIME, &before), 0);
  EXPECT_EQ(state.policy, ThreadPolicy::other);
  EXPECT_THAT(state.refused, StartsWith("SCHED_FIFO 10: RLIMIT_RTTIME is 60000000 us"));
  EXPECT_EQ(applied(urgent, Realtime::prefer).refused, "");
}

TEST(ThreadAttributes, RecordARefusedNiceValue) {
  const std::string text = in_child(Rights::none, [] {
    return apply({.name = "control", .nice = -5}, Realtime::prefer).refused;
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("nice -5: "));
}

TEST(ThreadAttributes, AskNothingThatCouldBeRefusedWhenRealtimeIsOff) {
  const std::string text = in_child(Rights::none, [] {
    const ThreadState state =
        apply({.name = "control", .policy = ThreadPolicy::fifo, .priority = 80}, Realtime::off);
    return state.name + "," + std::string(to_string(state.policy)) + "," + state.refused;
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_EQ(text, "control,SCHED_OTHER,");
}

TEST(ThreadAttributes, WhatIsNotWrittenIsTheDefaultNotWhatTheMakerHas) {
  if (!fifo_is_granted()) GTEST_SKIP() << kNoRights;
  ThreadState made;
  std::thread([&] {
    apply({.name = "maker",
           .policy = ThreadPolicy::fifo,
           .priority = 60,
           .affinity = {available_cpus().front()}},
          Realtime::require);
    made = RealtimeThread({.name = "made"}, Realtime::prefer, [] {}).state();
  }).join();
  EXPECT_EQ(made.policy, ThreadPolicy::other);
  EXPECT_EQ(made.priority, 0);
  EXPECT_EQ(made.affinity, available_cpus());
  EXPECT_EQ(made.refused, "");
}

// In a process of its own, as the log thread starts once.
TEST(ThreadAttributes, TheLogThreadHasTheDefaultsWhoeverLogsFirst) {
  if (!fifo_is_granted()) GTEST_SKIP() << kNoRights;
  const std::string text = in_child(Rights::as_they_are, [] {
    apply({.name = "urgent",
           .policy = ThreadPolicy::fifo,
           .priority = 60,
           .affinity = {available_cpus().front()}},
          Realtime::require);
    ThreadState state;
    Logger::instance().set_writer([](LogLevel, std::string_view) {});
    log(LogLevel::error, "first");
    Logger::instance().run_in_thread([&] { state = this_thread_state(); });
    return state.name + " " + std::string(to_string(state.policy)) +
           (state.affinity == available_cpus() ? " on all" : " on some");
  });
  EXPECT_EQ(text, "log SCHED_OTHER on all");
}

}  // namespace
}  // namespace takt
