// A join sends when all its inputs have come: of these nothing may be taken for granted.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/join_losses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"

namespace takt::test {
namespace {

using ::testing::HasSubstr;

/// `a` sends /x, `s` sends /w; `j` joins both, and the chain goes by /x.
struct Joined {
  std::string top = {}, s = "component: takt::Workload", period_x = "10000", period_y = "10000";

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
  EXPECT_THAT(why(late), HasSubstr("waits for '/j/w': messages of '/j/w' may wait for longer"));
}

}  // namespace
}  // namespace takt::test
