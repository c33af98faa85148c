// The rules of PiCAS, each by its number.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/picas.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::picas {
namespace {

using testing::Each;
using testing::ElementsAre;

// Three chains over eight callbacks in six units; the last callback is on none.
//   a (priority 1): 0 → 1 → 2      b (priority 3): 3 → 4 → 2      c (priority 2): 5 → 6
// Callbacks 1 and 4 share a unit, and so do 6 and 7.
class Picas : public testing::Test {
 protected:
  Assignment assigned(const std::vector<int>& cpus = {0, 1}) const {
    return assign(callbacks_, chains_, cpus, 80);
  }
  std::vector<Callback> callbacks_{{0, .2}, {1, .1}, {2, .1}, {3, .3},
                                   {1, .2}, {4, .1}, {5, .1}, {5, 0}};
  std::vector<Chain> chains_{{1, {0, 1, 2}}, {3, {3, 4, 2}}, {2, {5, 6}}};
};

TEST_F(Picas, RuleOneALaterCallbackOfAChainIsMoreUrgent) {
  const auto priority = assigned().callback_priority;
  EXPECT_LT(priority[3], priority[4]);
  EXPECT_LT(priority[4], priority[2]);
  EXPECT_LT(priority[5], priority[6]);
  EXPECT_LT(priority[0], priority[1]);
}

TEST_F(Picas, RuleTwoAMoreCriticalChainIsMoreUrgentAsAWhole) {
  const auto priority = assigned().callback_priority;
  EXPECT_GT(priority[3], priority[6]);  // the least of b above the most of c
  EXPECT_GT(priority[5], priority[1]);  // the least of c above the most of what a has alone
  EXPECT_GT(priority[1], 0);
  EXPECT_EQ(priority[7], 0);
}

TEST_F(Picas, RuleTwoASharedCallbackBelongsToTheMostCriticalChain) {
  EXPECT_THAT(assigned().chain_of_callback, ElementsAre(0, 0, 1, 1, 1, 2, 2, kNone));
}

TEST_F(Picas, RuleThreeEachChainHasItsExecutorAndTheMostCriticalTakesWhatIsShared) {
  const Assignment result = assigned();
  ASSERT_EQ(result.executors.size(), 3u);
  EXPECT_EQ(result.executors[0].chain, 1u);
  EXPECT_EQ(result.executors[1].chain, 2u);
  EXPECT_EQ(result.executors[2].chain, 0u);
  EXPECT_THAT(result.executor_of_unit, ElementsAre(2, 0, 0, 0, 1, 1));
}

TEST_F(Picas, RuleThreeAChainThatOthersHaveWhollyNeedsNoExecutor) {
  chains_.push_back({0, {4, 2}});
  EXPECT_EQ(assigned().executors.size(), 3u);
}

TEST_F(Picas, RuleThreeUnitsOutsideChainsAreLeftToTheCaller) {
  callbacks_[7].unit = 6;
  EXPECT_EQ(assigned().executor_of_unit[6], kNone);
}

TEST_F(Picas, RuleFourTheMoreCriticalChainHasTheLargerThreadPriority) {
  const auto executors = assigned().executors;
  EXPECT_EQ(executors[0].thread_priority, 80);
  EXPECT_EQ(executors[1].thread_priority, 79);
  EXPECT_EQ(executors[2].thread_priority, 78);
}

TEST_F(Picas, RuleFourPrioritiesEndAtOne) {
  chains_.clear();
  callbacks_.clear();
  for (std::size_t i = 0; i < 100; ++i) {
    callbacks_.push_back({i, 0});
    chains_.push_back({0, {i}});
  }
  const auto executors = assigned().executors;
  EXPECT_EQ(executors[79].thread_priority, 1);
  EXPECT_EQ(executors[99].thread_priority, 1);
}

TEST_F(Picas, RuleFiveTheMostCriticalChainHasTheFirstChoiceOfCpus) {
  const auto executors = assigned({2, 5}).executors;
  EXPECT_EQ(executors[0].cpu, 2);  // b and what a shares: 0.7
  EXPECT_NEAR(executors[0].utilisation, .7, 1e-9);
  EXPECT_EQ(executors[1].cpu, 5);  // 0.2
  EXPECT_EQ(executors[2].cpu, 5);
}

TEST_F(Picas, RuleFiveCountsExecutorsWhereNothingIsKnownOfUtilisation) {
  for (Callback& callback : callbacks_) callback.utilisation = 0;
  const auto executors = assigned().executors;
  EXPECT_EQ(executors[0].cpu, 0);
  EXPECT_EQ(executors[1].cpu, 1);
  EXPECT_EQ(executors[2].cpu, 0);
}

TEST(PicasAssign, NothingComesOfNoChains) {
  const Assignment result = assign({{0, .5}, {1, .5}}, {}, {0}, 80);
  EXPECT_TRUE(result.executors.empty());
  EXPECT_THAT(result.executor_of_unit, Each(kNone));
}

}  // namespace
}  // namespace takt::picas
