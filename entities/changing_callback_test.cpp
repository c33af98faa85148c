// Tests of callbacks that take a std::shared_ptr<T>: they may change the message.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"

namespace takt::changing_callback_test {
namespace {

using testing::ElementsAre;

struct Reading {
  int id = 0;
};
TAKT_MESSAGE(Reading, "test_msgs/msg/Reading", id);

class ChangingCallbackTest : public testing::Test {
 protected:
  template <class F>
  auto subscribe(F callback) {
    return node_->create_subscription<Reading>("reading", 10, std::move(callback));
  }
  auto publisher(std::size_t loans = 0) {
    return node_->create_publisher<Reading>("reading", 10, {.loans = loans});
  }
  static int run_all(Entity& entity) {
    int count = 0;
    for (Slot slot; entity.take(slot); ++count) entity.execute(slot);
    return count;
  }

  std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
};

TEST_F(ChangingCallbackTest, ChangesTheMessageItselfWhenItIsAlone) {
  const auto readings = publisher();
  std::vector<std::shared_ptr<Reading>> kept;
  const auto changes = subscribe([&](std::shared_ptr<Reading> reading) {
    ++reading->id;
    kept.push_back(std::move(reading));
  });
  auto message = std::make_unique<Reading>(Reading{.id = 8});
  const Reading* const address = message.get();
  readings->publish(std::move(message));
  EXPECT_EQ(run_all(*changes), 1);
  EXPECT_EQ(kept[0].get(), address);
  readings->publish(Reading{.id = 10});  // the publisher's copy is for its receivers
  EXPECT_EQ(run_all(*changes), 1);
  readings->publish(Reading{.id = 20});  // while the one before it is kept
  EXPECT_EQ(run_all(*changes), 1);
  EXPECT_EQ(kept[0]->id, 9);
  EXPECT_EQ(kept[1]->id, 11);
  EXPECT_EQ(kept[2]->id, 21);
}

TEST_F(ChangingCallbackTest, ChangesACopyOfWhatOthersSee) {
  const auto lends = publisher(1), readings = publisher();
  std::vector<int> seen;
  const auto changes =
      subscribe([&](const std::shared_ptr<Reading>& reading) { seen.push_back(++reading->id); });
  const auto looks = subscribe([&](const Reading& reading) { seen.push_back(reading.id); });
  readings->publish(Reading{.id = 10});
  run_all(*changes);
  run_all(*looks);
  const auto shared = std::make_shared<const Reading>(Reading{.id = 20});
  readings->publish(shared);
  run_all(*looks);
  run_all(*changes);  // the last one, but it is the user's
  EXPECT_EQ(shared->id, 20);
  LoanedMessage<Reading> loan = lends->borrow_loaned_message();
  loan->id = 30;
  lends->publish(std::move(loan));
  run_all(*looks);
  run_all(*changes);
  EXPECT_EQ(lends->borrow_loaned_message()->id, 30);  // a loan keeps what its publisher wrote
  EXPECT_THAT(seen, ElementsAre(11, 10, 20, 21, 30, 31));
}

TEST_F(ChangingCallbackTest, ChangesACopyWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto readings = publisher();
  int sum = 0;
  const auto change = [&](const std::shared_ptr<Reading>& reading) { sum += ++reading->id; };
  const auto first = subscribe(change), second = subscribe(change);
  const auto round = [&] {
    readings->publish(Reading{.id = 1});
    run_all(*first);
    run_all(*second);
  };
  round();
  const RealtimeScope scope;
  for (int i = 0; i < 10; ++i) round();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(sum, 44);
}

}  // namespace
}  // namespace takt::changing_callback_test
