// SPDX-License-Identifier: Apache-2.0
#include "run/setup.hpp"

#include <gmock/gmock.h>

namespace takt::tools {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

rt::Run::Thread thread(const char* executor, int priority, const std::vector<int>& cpus) {
  return {.process = "robot",
          .executor = executor,
          .in_force = {.policy = priority == 0 ? ThreadPolicy::other : ThreadPolicy::fifo,
                       .priority = priority,
                       .affinity = cpus}};
}

rt::Run run_of(const char* scheduler, std::size_t threads_given,
               const std::vector<rt::Run::Thread>& threads) {
  return {.executors = {{"fast", "events", scheduler, threads_given, "robot"}}, .threads = threads};
}

TEST(SetupOfARun, HasTheThreadsOfComponentsAlone) {
  const tools::Setup setup = setup_of(run_of(
      "fifo", 2, {thread("fast", 80, {0}), thread("requests", 0, {0, 1}), thread("dds", 0, {1})}));
  EXPECT_EQ(setup.threads, 1U);
  EXPECT_EQ(setup.threads_text(), "1/2");
  EXPECT_EQ(setup.priorities, "SCHED_FIFO 80");
  EXPECT_EQ(setup.cpus, "0");
  EXPECT_EQ(setup.schedulers, "fifo");
}

/// What one executor has more than the file gives does not hide what another leaves unused.
TEST(SetupOfARun, CountsUnusedThreadsOfEachExecutor) {
  rt::Run run =
      run_of("fifo", 2, {thread("fast", 80, {0}), thread("slow", 0, {0}), thread("slow", 0, {0})});
  run.executors.push_back({"slow", "isolated", "ros", 1, "robot"});
  EXPECT_EQ(setup_of(run).threads_text(), "3/4");
}

TEST(SetupOfARun, SaysWhatDiffers) {
  const tools::Setup one = setup_of(run_of("fifo", 1, {thread("fast", 80, {0})}));
  const tools::Setup other = setup_of(run_of("ros", 1, {thread("fast", 80, {0})}));
  const tools::Setup two =
      setup_of(run_of("fifo", 1, {thread("fast", 80, {0}), thread("fast", 0, {1})}));
  EXPECT_EQ(difference(one, one), "");
  EXPECT_EQ(difference(one, other), "");  // the type's own order is of its word
  EXPECT_EQ(difference(two, one),
            "threads 2 against 1, priorities SCHED_FIFO 80 and SCHED_OTHER against SCHED_FIFO 80, "
            "CPUs 0 and 1 against 0");
  const std::vector<std::pair<std::string, tools::Setup>> rows{{"events", one}, {"edf", one}};
  EXPECT_THAT(differences(rows), IsEmpty());
  const std::vector<std::pair<std::string, tools::Setup>> others{
      {"events", one}, {"single_threaded", other}, {"triggered", other}};
  EXPECT_THAT(differences(others),
              ElementsAre("scheduler: fifo (events); ros (single_threaded, triggered)"));
}

TEST(SetupOfARun, OfAnEarlierTaktIsNotKnown) {
  const tools::Setup known = setup_of(run_of("fifo", 1, {thread("fast", 80, {0})}));
  EXPECT_EQ(difference(known, setup_of({.threads = {thread("fast", 0, {1})}})), "");
}

}  // namespace
}  // namespace takt::tools
