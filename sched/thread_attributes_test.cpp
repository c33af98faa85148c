// Tests of what Linux is told about threads, granted and refused.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/thread_attributes.hpp"

#include <functional>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

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

// Runs `body` in a child process without any right to a real-time policy and returns its text;
// "cannot drop rights" when that does not work here.
std::string without_rights(const std::function<std::string()>& body) {
  int channel[2];
  EXPECT_EQ(pipe(channel), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(channel[0]);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_RTPRIO, &none);
    setrlimit(RLIMIT_NICE, &none);
    // From root to nobody the kernel takes all capabilities away.
    const bool dropped = getuid() != 0 || setuid(65534) == 0;
    const std::string text = dropped ? body() : "cannot drop rights";
    const bool sent = write(channel[1], text.data(), text.size()) >= 0;
    _exit(sent ? 0 : 1);
  }
  close(channel[1]);
  std::string text;
  char buffer[256];
  for (ssize_t size; (size = read(channel[0], buffer, sizeof buffer)) > 0;) {
    text.append(buffer, static_cast<std::size_t>(size));
  }
  close(channel[0]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
  return text;
}
constexpr const char* kCannotDrop = "cannot drop rights";

// ---- Names ----

TEST(ThreadPolicy, HasTheNamesOfTheManual) {
  for (const ThreadPolicy policy : {ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr,
                                    ThreadPolicy::batch, ThreadPolicy::idle}) {
    EXPECT_EQ(thread_policy(to_string(policy)), policy);
  }
  EXPECT_EQ(to_string(ThreadPolicy::fifo), "SCHED_FIFO");
}

TEST(ThreadPolicy, AnswersAnUnknownNameWithTheValidOnes) {
  EXPECT_THAT([] { thread_policy("SCHED_FIFA"); },
              ThrowsMessage<Error>("there is no thread policy 'SCHED_FIFA'; did you mean "
                                   "'SCHED_FIFO'? valid: SCHED_OTHER, SCHED_FIFO, SCHED_RR, "
                                   "SCHED_BATCH, SCHED_IDLE"));
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
        Impossible{{.nice = -21}, "nice -21 does not exist; choose -20 to 19"}));

TEST(ThreadAttributes, NameACpuThatIsNotThereAndThoseThatAre) {
  const ThreadAttributes attributes{.affinity = {CPU_SETSIZE - 1}};
  EXPECT_THAT([&] { attributes.check(); },
              ThrowsMessage<Error>(AllOf(StartsWith("there is no CPU 1023 here; choose from "),
                                         HasSubstr(std::to_string(available_cpus()[0])))));
  EXPECT_NO_THROW(ThreadAttributes{.affinity = available_cpus()}.check());
}

// ---- What is granted ----

TEST(ThreadAttributes, TellWhatTheThreadHas) {
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

// ---- What is refused ----

TEST(ThreadAttributes, ThrowWhenRequiredAndRefused) {
  const std::string text = without_rights([] {
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
  const std::string text = without_rights([] {
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

TEST(ThreadAttributes, RecordARefusedNiceValue) {
  const std::string text = without_rights(
      [] { return apply({.name = "control", .nice = -5}, Realtime::prefer).refused; });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_THAT(text, StartsWith("nice -5: "));
}

TEST(ThreadAttributes, AskNothingThatCouldBeRefusedWhenRealtimeIsOff) {
  const std::string text = without_rights([] {
    const ThreadState state =
        apply({.name = "control", .policy = ThreadPolicy::fifo, .priority = 80}, Realtime::off);
    return state.name + "," + std::string(to_string(state.policy)) + "," + state.refused;
  });
  if (text == kCannotDrop) GTEST_SKIP() << kCannotDrop;
  EXPECT_EQ(text, "control,SCHED_OTHER,");
}

}  // namespace
}  // namespace takt
