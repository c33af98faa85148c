// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/spin_always.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using ::testing::HasSubstr;

const ThreadAttributes kFifo{
    .name = "control", .policy = ThreadPolicy::fifo, .priority = 80, .affinity = {1}};

std::string refusal(const std::vector<ThreadAttributes>& spinning,
                    const std::vector<ThreadAttributes>& others = {}, std::size_t cpus = 4) {
  try {
    check_spin_always(spinning, others, cpus);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SpinAlways, NeedsACpuOfItsOwnIfNothingCanPreemptIt) {
  EXPECT_EQ(refusal({kFifo}), "");
  ThreadAttributes anywhere = kFifo;
  anywhere.affinity = {};
  EXPECT_EQ(
      refusal({anywhere}),
      "thread 'control' never sleeps (`spin: always`) and has SCHED_FIFO without a CPU of its "
      "own; give it an affinity of one CPU, or spin for a time, such as 50us");
  anywhere.affinity = {1, 2};
  EXPECT_THAT(refusal({anywhere}), HasSubstr("without a CPU of its own"));
  anywhere.policy = ThreadPolicy::rr;
  EXPECT_THAT(refusal({anywhere}), HasSubstr("SCHED_RR without a CPU of its own"));
}

TEST(SpinAlways, HasNoOtherThreadBesideItIfNothingCanPreemptIt) {
  EXPECT_EQ(
      refusal({kFifo}, {{.name = "dds"}}),
      "thread 'control' never sleeps (`spin: always`) and has SCHED_FIFO on CPU 1, where "
      "thread 'dds' may run, too; give that one an affinity without CPU 1, or spin for a time, "
      "such as 50us");
  EXPECT_THAT(refusal({kFifo}, {{.name = "dds", .affinity = {0, 1}}}), HasSubstr("'dds' may run"));
  EXPECT_THAT(refusal({kFifo, kFifo}), HasSubstr("'control' may run"));
  EXPECT_EQ(refusal({kFifo}, {{.name = "dds", .affinity = {0, 2}}}), "");
  const ThreadAttributes reservation{.name = "first",
                                     .policy = ThreadPolicy::deadline,
                                     .runtime = std::chrono::milliseconds(1),
                                     .period = std::chrono::milliseconds(10)};
  EXPECT_EQ(refusal({kFifo}, {reservation}), "") << "that preempts it";
  EXPECT_EQ(refusal({{.name = "fair", .affinity = {1}}}, {{.name = "dds"}}), "");
}

TEST(SpinAlways, IsNotForAReservation) {
  EXPECT_EQ(
      refusal({{.name = "r", .policy = ThreadPolicy::deadline}}),
      "thread 'r' never sleeps (`spin: always`) and has SCHED_DEADLINE, whose runtime it would "
      "use up; choose another policy, or spin for a time, such as 50us");
}

TEST(SpinAlways, LeavesACpuToTheRest) {
  EXPECT_EQ(refusal({kFifo}, {}, 2), "");
  EXPECT_EQ(
      refusal({kFifo}, {}, 1),
      "threads that never sleep (`spin: always`) would take all 1 CPUs; leave one to the rest "
      "of the system: spin with fewer threads, or spin for a time, such as 50us");
  EXPECT_THAT(refusal({kFifo, {.name = "anywhere", .affinity = {0, 2}}}, {}, 2),
              HasSubstr("take all 2 CPUs"));
  EXPECT_EQ(refusal({{.name = "a", .affinity = {0}}, {.name = "b", .affinity = {0}}}, {}, 2), "");
  EXPECT_EQ(refusal({}, {}, 1), "");
}

}  // namespace
}  // namespace takt
