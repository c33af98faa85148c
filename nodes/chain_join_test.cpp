// Tests of chains that go on together: which instances a message belongs to behind a join.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/chain_join.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const CallbackInfo kInfo;

/// A callback that a message of `before` calls; it is the first one when that is nullptr.
Dispatch dispatch(const Dispatch* before, std::uint64_t entity, TimePoint released = {}) {
  const std::uint64_t path = before != nullptr ? before->path : 0;
  return {&kInfo, before != nullptr ? before->chain_instance : 100 + entity,
          before != nullptr ? before->root_release : released,
          extend_path(path, path_mark(entity))};
}

std::uint64_t path_of(std::initializer_list<std::uint64_t> entities) {
  std::uint64_t path = 0;
  for (const std::uint64_t entity : entities) path = extend_path(path, path_mark(entity));
  return path;
}

void received(ChainJoin& join, Dispatch& by, std::size_t input) {
  const Dispatch::Scope scope(by);
  join.received(input);
}
void combine(ChainJoin& join, Dispatch& by) {
  const Dispatch::Scope scope(by);
  join.combine();
}

TEST(ChainJoin, BothInstancesGoOnThroughAllThatFollows) {
  ChainJoin join(2);
  Dispatch left = dispatch(nullptr, 1, TimePoint(1ms)), left_in = dispatch(&left, 2);
  Dispatch right = dispatch(nullptr, 3, TimePoint(2ms)), right_in = dispatch(&right, 4);
  received(join, left_in, 0);
  received(join, right_in, 1);
  combine(join, right_in);
  Dispatch next = dispatch(&right_in, 5);
  EXPECT_EQ(root_release(next, path_of({1, 2, 5})), TimePoint(1ms));
  EXPECT_EQ(root_release(next, path_of({3, 4, 5})), TimePoint(2ms));
  next = dispatch(&next, 6);
  next = dispatch(&next, 7);
  EXPECT_EQ(root_release(next, path_of({1, 2, 5, 6, 7})), TimePoint(1ms));
  EXPECT_EQ(root_release(next, path_of({3, 4, 5, 6, 7})), TimePoint(2ms));
  EXPECT_EQ(root_release(next, path_of({1, 2, 5, 7, 6})), std::nullopt);
  EXPECT_EQ(root_release(next, path_of({1, 4, 5, 6, 7})), std::nullopt);
  EXPECT_EQ(instance_before_joins(next.chain_instance), right.chain_instance);
}

TEST(ChainJoin, AnInstanceGoesOnOnce) {
  ChainJoin join(2);
  Dispatch left = dispatch(nullptr, 1, TimePoint(1ms)),
           left_again = dispatch(nullptr, 1, TimePoint(3ms));
  Dispatch right = dispatch(nullptr, 2, TimePoint(4ms));
  received(join, left, 0);
  received(join, left_again, 0);  // takes its place
  received(join, right, 1);
  combine(join, right);
  EXPECT_EQ(root_release(dispatch(&right, 3), path_of({1, 3})), TimePoint(3ms));
  Dispatch later = dispatch(nullptr, 2, TimePoint(5ms));
  received(join, later, 1);
  combine(join, later);
  EXPECT_EQ(root_release(dispatch(&later, 3), path_of({1, 3})), std::nullopt);
  EXPECT_EQ(root_release(dispatch(&later, 3), path_of({2, 3})), TimePoint(5ms));
}

TEST(ChainJoin, GoesThroughJoinsOfJoins) {
  ChainJoin first(2), second(2);
  Dispatch a = dispatch(nullptr, 1, TimePoint(1ms)), b = dispatch(nullptr, 2, TimePoint(2ms));
  received(first, a, 0);
  received(first, b, 1);
  combine(first, b);
  Dispatch ab = dispatch(&b, 3), c = dispatch(nullptr, 4, TimePoint(4ms));
  received(second, ab, 0);
  received(second, c, 1);
  combine(second, c);
  Dispatch end = dispatch(&c, 5);
  EXPECT_EQ(root_release(end, path_of({1, 3, 5})), TimePoint(1ms));
  EXPECT_EQ(root_release(end, path_of({2, 3, 5})), TimePoint(2ms));
  EXPECT_EQ(root_release(end, path_of({4, 5})), TimePoint(4ms));
}

TEST(ChainJoin, ATimerTakesWhatLiesThere) {
  ChainJoin join(1);
  Dispatch input = dispatch(nullptr, 1, TimePoint(1ms));
  received(join, input, 0);
  Dispatch timer = dispatch(nullptr, 2, TimePoint(5ms));
  combine(join, timer);
  EXPECT_EQ(root_release(dispatch(&timer, 3), path_of({1, 3})), TimePoint(1ms));
  EXPECT_EQ(root_release(dispatch(&timer, 3), path_of({2, 3})), TimePoint(5ms));
}

TEST(ChainJoin, CountsWhatDoesNotFitAndForgetsTheOldest) {
  ChainJoin join(JoiningInstances::kMost), wider(2);
  std::vector<Dispatch> inputs;
  for (std::uint64_t i = 0; i < JoiningInstances::kMost; ++i) {
    inputs.push_back(dispatch(nullptr, i + 1));
    received(join, inputs.back(), i);
  }
  combine(join, inputs.back());
  EXPECT_EQ(join.left_out(), 0u);
  received(wider, inputs.back(), 0);  // sixteen, of which one comes in the envelope
  Dispatch another = dispatch(nullptr, 50);
  received(wider, another, 1);
  combine(wider, another);
  EXPECT_EQ(wider.left_out(), 0u);
  Dispatch third = dispatch(nullptr, 51);
  received(wider, another, 0);
  received(wider, third, 1);
  combine(wider, third);
  EXPECT_EQ(wider.left_out(), 1u);

  Dispatch old = dispatch(nullptr, 1, TimePoint(7ms));
  combine(join, old);  // alone
  EXPECT_FALSE(is_joined(old.chain_instance));
  received(join, old, 0);
  Dispatch last = dispatch(nullptr, 2, TimePoint(8ms));
  combine(join, last);
  Dispatch next = dispatch(&last, 3);
  EXPECT_EQ(root_release(next, path_of({1, 3})), TimePoint(7ms));
  for (std::size_t i = 0; i < ChainJoin::kMostJoined; ++i) {
    received(join, old, 0);
    Dispatch later = dispatch(nullptr, 2);
    combine(join, later);
  }
  EXPECT_EQ(root_release(next, path_of({1, 3})), std::nullopt);
  EXPECT_EQ(root_release(next, path_of({2, 3})), TimePoint(8ms));  // the envelope's own
}

TEST(ChainJoin, OutsideACallbackItDoesNothing) {
  ChainJoin join(1);
  join.received(0);
  join.combine();
  Dispatch alone = dispatch(nullptr, 1);
  combine(join, alone);
  EXPECT_FALSE(is_joined(alone.chain_instance));
}

TEST(ChainJoin, SaysHowManyInputsItCanHave) {
  EXPECT_THAT([] { ChainJoin join(0); }, ThrowsMessage<Error>(HasSubstr("give it 1 to 16")));
  EXPECT_THAT([] { ChainJoin join(17); }, ThrowsMessage<Error>(HasSubstr("give it 1 to 16")));
}

}  // namespace
}  // namespace takt
