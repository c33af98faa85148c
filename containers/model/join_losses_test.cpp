// A join sends when all its inputs have come: of these nothing may be taken for granted.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/join_losses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// `a` sends /x, `s` sends /w; `j` joins both, and the chain goes by /x.
struct Joined {
  std::string top = {}, s = "component: takt::Workload", period_x = "10000", period_y = "10000",
              of_a = {};

  Analyzed analyzed() const {
    return test::analyzed("realtime: require\n" + top + R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, deadline: 500ms, path: [a/x_timer, j/x, b/z]}]
container:
  name: joined
  components:
    - component: takt::Workload
      name: a
      executor: default
      parameters: {publishers: {topic: [x], period_us: [)" +
                              period_x + R"(], work_us: [100]}}
      )" + of_a + R"(
    - name: s
      executor: default
      )" + s + R"(
      parameters: {publishers: {topic: [w], period_us: [)" +
                              period_y + R"(], work_us: [100]}}
    - component: takt::Workload
      name: j
      executor: default
      parameters: {relays: {input: [x, w], output: [z, z], work_us: [100, 100]}}
    - component: takt::Workload
      name: b
      executor: default
      parameters: {subscriptions: {topic: [z], work_us: [100]}}
)",
                          nullptr, /*accepts_all=*/true);
  }
};

std::string why(const Analyzed& found) {
  return found.bound().why_not + found.bound().why_lossy;
}

TEST(JoinLosses, InputsThatComeMoreOftenReplaceNothing) {
  const Analyzed found = Joined{.period_x = "100000"}.analyzed();
  EXPECT_EQ(found.verdict(), Verdict::guaranteed) << why(found);
}

// The bound relied on the next message of the own input, which never came: it had expired, or its
// instance was ended, or its publisher had nothing to lend.
TEST(JoinLosses, ANextOneThatMayBeLostEndsNoWait) {
  EXPECT_LT(Joined{.period_y = "50000"}.analyzed().bound().bound, 20ms);
  for (const Joined& lossy :
       {Joined{.top = "topics: {/x: {lifespan: 10us}}\n", .period_y = "50000"},
        Joined{.period_y = "50000",
        .of_a = "callbacks: {x_timer: {deadline: 1us, overrun: abort}}"}}) {
    EXPECT_GT(lossy.analyzed().bound().bound, 50ms);  // until the other input has come again
  }
}

// Two of one release were taken for one, and one that comes late for one of its period.
TEST(JoinLosses, OfOneReleaseOnlyWhatComesOnceAndInTimeIsKept) {
  const auto found = [](const char* period_us, const char* relays) {
    return analyzed(fmt::format(R"(
realtime: require
threads:
  one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}
  two: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}
  three: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}
machine: {{cpus: [0, 1], rt_runtime: unlimited}}
executors:
  default: {{type: events, threads: [one]}}
  two: {{type: events, threads: [two]}}
  three: {{type: events, threads: [three]}}
chains: [{{name: c, deadline: 500ms, path: [s/p_timer, n/p, j/r, k/o]}}]
container:
  name: joined
  components:
    - {{component: takt::Workload, name: s, executor: default, parameters: {{publishers: {{topic: [p], period_us: [{}], work_us: [100], depth: [20]}}}}}}
    - {{component: takt::Workload, name: n, executor: two, parameters: {{relays: {{input: [p], output: [r], work_us: [1000], depth: [20]}}}}}}
{}
    - {{component: takt::Workload, name: j, executor: default, parameters: {{relays: {{input: [p, r], output: [o, o], work_us: [50, 50], depth: [20, 20]}}}}}}
    - {{component: takt::Workload, name: k, executor: default, parameters: {{subscriptions: {{topic: [o], work_us: [50], depth: [20]}}}}}}
)",
                                period_us, relays),
                    nullptr, /*accepts_all=*/true);
  };
  const char* const second =
      "    - {component: takt::Workload, name: m, executor: default, parameters: {relays: {input: "
      "[p], output: [r], work_us: [50], depth: [20]}}}";
  const char* const slow =
      "    - {component: takt::Workload, name: m, executor: three, parameters: {publishers: "
      "{topic: [x], period_us: [200000], work_us: [25000]}}}";
  EXPECT_EQ(found("20000", "").verdict(), Verdict::guaranteed) << why(found("20000", ""));
  for (const Analyzed& lossy : {found("20000", second), found("10000", slow)}) {
    EXPECT_EQ(lossy.verdict(), Verdict::may_lose);
    EXPECT_THAT(why(lossy), HasSubstr("a join before '/k/o'"));
  }
}

TEST(JoinLosses, OneThatWaitsIsReplacedByTheNext) {
  const Analyzed slow = Joined{.period_y = "500000"}.analyzed();
  EXPECT_EQ(slow.verdict(), Verdict::may_lose);
  EXPECT_EQ(slow.bound().one_of, 51);
  EXPECT_THAT(why(slow), HasSubstr("may send only the last one"));
  // Of equal periods, two of one may lie between two of the other.
  EXPECT_EQ(Joined().analyzed().verdict(), Verdict::may_lose);
}

TEST(JoinLosses, WhatNeverComesEndsTheChain) {
  const Analyzed lifecycle = Joined{.s = "component: takt::LifecycleWorkload"}.analyzed();
  EXPECT_EQ(lifecycle.verdict(), Verdict::no_bound);
  EXPECT_THAT(why(lifecycle), HasSubstr("a join before '/b/z' waits for '/j/w': nobody brings"));
  Joined other;
  other.s = "component: takt::Workload\n      remap: {w: elsewhere}";
  EXPECT_EQ(other.analyzed().verdict(), Verdict::no_bound);
  EXPECT_THAT(why(other.analyzed()), HasSubstr("nothing comes to '/j/w'"));
}

TEST(JoinLosses, WhatTheOtherInputLosesIsLost) {
  const Analyzed late =
      Joined{.top = "topics: {/w: {lifespan: 1us}}\n", .period_x = "100000"}.analyzed();
  EXPECT_EQ(late.verdict(), Verdict::may_lose);
  EXPECT_THAT(why(late),
              HasSubstr("waits for '/j/w': messages of '/j/w' may take and wait longer"));
}

}  // namespace
}  // namespace takt::test
