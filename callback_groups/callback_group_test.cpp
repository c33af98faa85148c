// Tests of exclusion, and of where callbacks wait meanwhile.
// SPDX-License-Identifier: Apache-2.0
#include "takt/callback_groups/callback_group.hpp"

#include <memory>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

class ExclusionTest : public testing::Test {
 protected:
  static constexpr std::size_t kCallbacks = 4;

  ExclusionTest() : infos_(kCallbacks), callbacks_(kCallbacks) {
    for (std::size_t i = 0; i < kCallbacks; ++i) {
      infos_[i].id = static_cast<CallbackId>(i);
      infos_[i].registration = static_cast<std::uint32_t>(i);
      infos_[i].priority = static_cast<int>(i);  // the last is the most urgent
      callbacks_[i].info = &infos_[i];
      callbacks_[i].sequence = i + 1;
    }
    exclusive_.set_parking(scheduler("fifo"));
  }
  std::unique_ptr<Scheduler> scheduler(std::string_view name) const {
    auto result = schedulers().make(name, {});
    result->configure(infos_);
    return result;
  }

  std::vector<CallbackInfo> infos_;
  std::vector<ReadyCallback> callbacks_;
  Exclusion exclusive_{CallbackGroupType::MutuallyExclusive};
};

TEST(CallbackGroupTest, KeepsItsNameTypeAndParameters) {
  CallbackGroup group("exclusive", CallbackGroupType::MutuallyExclusive);
  EXPECT_EQ(group.name(), "exclusive");
  EXPECT_EQ(group.type(), CallbackGroupType::MutuallyExclusive);
  EXPECT_TRUE(group.automatically_add_to_executor());
  EXPECT_FALSE(group.parameters().priority.has_value());
  group.set_parameters({.priority = 7, .deadline = Nanoseconds(9)});
  EXPECT_EQ(group.parameters().priority, 7);
  EXPECT_EQ(group.parameters().deadline, Nanoseconds(9));
  const CallbackGroup by_hand("reentrant", CallbackGroupType::Reentrant, false);
  EXPECT_FALSE(by_hand.automatically_add_to_executor());
}

TEST(CallbackGroupTest, BelongsToOneOwnerAtATime) {
  CallbackGroup group("group", CallbackGroupType::MutuallyExclusive);
  const int first = 0, second = 0;
  EXPECT_TRUE(group.claim(&first));
  EXPECT_TRUE(group.belongs_to(&first));
  EXPECT_FALSE(group.claim(&second));
  EXPECT_FALSE(group.claim(&first));
  group.release(&second);  // not its to release
  EXPECT_TRUE(group.belongs_to(&first));
  group.release(&first);
  EXPECT_FALSE(group.belongs_to(&first));
  EXPECT_TRUE(group.claim(&second));
}

TEST_F(ExclusionTest, MutuallyExclusiveGroupAdmitsOneCallbackAtATime) {
  EXPECT_TRUE(exclusive_.admit(callbacks_[0]));
  EXPECT_FALSE(exclusive_.admit(callbacks_[1]));
  EXPECT_FALSE(exclusive_.admit(callbacks_[2]));
}

TEST_F(ExclusionTest, ReentrantGroupAdmitsAllCallbacks) {
  Exclusion reentrant(CallbackGroupType::Reentrant);
  reentrant.set_parking(scheduler("fifo"));
  for (ReadyCallback& callback : callbacks_) EXPECT_TRUE(reentrant.admit(callback));
  EXPECT_TRUE(reentrant.admit(callbacks_[0]));  // the same one, a second time
  for (std::size_t i = 0; i < kCallbacks; ++i) EXPECT_EQ(reentrant.leave(), nullptr);
}

TEST_F(ExclusionTest, HandsBackOneParkedCallbackForEachThatLeaves) {
  ASSERT_TRUE(exclusive_.admit(callbacks_[0]));
  for (std::size_t i : {3u, 1u, 2u}) EXPECT_FALSE(exclusive_.admit(callbacks_[i]));
  // The first of them in the order of the scheduler, which is the order of arrival here.
  for (std::size_t i : {1u, 2u, 3u}) {
    ASSERT_EQ(exclusive_.leave(), &callbacks_[i]);
    ASSERT_TRUE(exclusive_.admit(callbacks_[i]));
  }
  EXPECT_EQ(exclusive_.leave(), nullptr);
  EXPECT_TRUE(exclusive_.admit(callbacks_[0]));
}

TEST_F(ExclusionTest, ParksAHandedBackCallbackAgainWhenAnotherWasFaster) {
  ASSERT_TRUE(exclusive_.admit(callbacks_[0]));
  ASSERT_FALSE(exclusive_.admit(callbacks_[1]));
  ASSERT_EQ(exclusive_.leave(), &callbacks_[1]);
  ASSERT_TRUE(exclusive_.admit(callbacks_[2]));
  EXPECT_FALSE(exclusive_.admit(callbacks_[1]));
  EXPECT_EQ(exclusive_.leave(), &callbacks_[1]);
}

TEST_F(ExclusionTest, HandsBackTheNextWhenTheFirstIsThrownAway) {
  ASSERT_TRUE(exclusive_.admit(callbacks_[0]));
  ASSERT_FALSE(exclusive_.admit(callbacks_[1]));
  ASSERT_FALSE(exclusive_.admit(callbacks_[2]));
  EXPECT_EQ(exclusive_.unpark(), nullptr);  // busy
  ASSERT_EQ(exclusive_.leave(), &callbacks_[1]);
  EXPECT_EQ(exclusive_.unpark(), &callbacks_[2]);
  EXPECT_EQ(exclusive_.unpark(), nullptr);
}

TEST_F(ExclusionTest, ParksInTheOrderOfItsScheduler) {
  exclusive_.set_parking(scheduler("fixed_priority"));
  ASSERT_TRUE(exclusive_.admit(callbacks_[0]));
  for (std::size_t i : {1u, 2u, 3u}) ASSERT_FALSE(exclusive_.admit(callbacks_[i]));
  EXPECT_EQ(exclusive_.leave(), &callbacks_[3]);
}

TEST_F(ExclusionTest, TakesWhatIsParkedAlongToANewParkingPlace) {
  ASSERT_TRUE(exclusive_.admit(callbacks_[0]));
  for (std::size_t i : {1u, 2u}) ASSERT_FALSE(exclusive_.admit(callbacks_[i]));
  ReadyCallback* parked = exclusive_.take_parked();
  ASSERT_EQ(parked, &callbacks_[1]);
  ASSERT_EQ(parked->next, &callbacks_[2]);
  EXPECT_EQ(parked->next->next, nullptr);
  const std::unique_ptr<Scheduler> old = exclusive_.set_parking(scheduler("fixed_priority"));
  ASSERT_NE(old, nullptr);
  EXPECT_EQ(old->pop(), nullptr);
  exclusive_.park(callbacks_[1]);
  exclusive_.park(callbacks_[2]);
  EXPECT_EQ(exclusive_.leave(), &callbacks_[2]);
  EXPECT_EQ(exclusive_.unpark(), &callbacks_[1]);
  EXPECT_EQ(exclusive_.unpark(), nullptr);
}

TEST_F(ExclusionTest, AdmitsAndLeavesWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const RealtimeScope scope;
  bool admitted = exclusive_.admit(callbacks_[0]);
  bool parked = !exclusive_.admit(callbacks_[1]) && !exclusive_.admit(callbacks_[2]);
  const ReadyCallback* handed_back = exclusive_.leave();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_TRUE(admitted && parked);
  EXPECT_EQ(handed_back, &callbacks_[1]);
}

}  // namespace
}  // namespace takt
