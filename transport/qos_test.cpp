// Tests of what is offered and asked for.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/qos.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/keep_last_ring.hpp"

namespace takt {
namespace {

using testing::ThrowsMessage;

TEST(QoS, IsAReliableHistoryOfTenMessagesByDefault) {
  const QoS qos;
  EXPECT_EQ(qos.depth, 10u);
  EXPECT_EQ(qos.reliability, Reliability::reliable);
}

TEST(QoS, IsMadeFromANumberAsInRclcpp) {
  const QoS qos = 5;
  EXPECT_EQ(qos.depth, 5u);
}

TEST(QoS, CanBeChangedInOneExpression) {
  EXPECT_EQ(QoS(5).best_effort().reliability, Reliability::best_effort);
  EXPECT_EQ(QoS(5).best_effort().reliable().reliability, Reliability::reliable);
  EXPECT_EQ(QoS(5).best_effort().depth, 5u);
}

TEST(QoS, ServesWhoAsksForNoMoreThanIsOffered) {
  const QoS reliable = QoS().reliable();
  const QoS best_effort = QoS().best_effort();
  EXPECT_TRUE(reliable.serves(reliable));
  EXPECT_TRUE(reliable.serves(best_effort));
  EXPECT_TRUE(best_effort.serves(best_effort));
  EXPECT_FALSE(best_effort.serves(reliable));
}

TEST(QoS, RefusesADepthThatARingCannotHold) {
  EXPECT_THAT([] { QoS(0).check(); },
              ThrowsMessage<Error>(
                  "a history of 0 messages cannot be kept; choose a depth from 1 to 16384"));
  EXPECT_THAT([] { QoS(16385).check(); },
              ThrowsMessage<Error>(
                  "a history of 16385 messages cannot be kept; choose a depth from 1 to 16384"));
  EXPECT_NO_THROW(QoS(1).check());
  EXPECT_NO_THROW(QoS(KeepLastRing<int>::kMaxDepth).check());
}

}  // namespace
}  // namespace takt
