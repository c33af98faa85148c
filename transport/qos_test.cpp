// Tests of what is offered and asked for.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/qos.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/keep_last_ring.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
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
  const QoS usual, best_effort = QoS().best_effort(), kept = QoS().transient_local(),
                   manual = QoS().liveliness(Liveliness::manual_by_topic);
  const auto deadline = [](Nanoseconds period) { return QoS().deadline(period); };
  const auto lease = [](Nanoseconds time) { return QoS().liveliness_lease_duration(time); };
  EXPECT_EQ(usual.refuses(usual), "");
  EXPECT_EQ(usual.refuses(best_effort), "");
  EXPECT_EQ(best_effort.refuses(usual), "reliability");
  EXPECT_EQ(kept.refuses(usual), "");
  EXPECT_EQ(usual.refuses(kept), "durability");
  EXPECT_EQ(deadline(10ms).refuses(usual), "");
  EXPECT_EQ(deadline(10ms).refuses(deadline(10ms)), "");
  EXPECT_EQ(deadline(11ms).refuses(deadline(10ms)), "deadline");
  EXPECT_EQ(usual.refuses(deadline(10ms)), "deadline");
  EXPECT_EQ(manual.refuses(usual), "");
  EXPECT_EQ(usual.refuses(manual), "liveliness");
  EXPECT_EQ(usual.refuses(lease(1s)), "lease_duration");
  EXPECT_EQ(lease(1s).refuses(lease(1s)), "");
  EXPECT_EQ(QoS().lifespan(1s).refuses(QoS()), "");
}

TEST(QoS, HasTheProfilesOfRclcpp) {
  EXPECT_EQ(qos_profile("sensor_data"), QoS(5).best_effort());
  EXPECT_EQ(qos_profile("system_default"), QoS(10));
  EXPECT_EQ(qos_profile("sensors"), std::nullopt);
  for (const std::string& name : qos_profile_names()) EXPECT_NO_THROW(qos_profile(name)->check());
}

TEST(QoS, OfTheCodeHoldsWhereNothingElseIsDecided) {
  const QoS code = QoS(7).transient_local().deadline(5ms);
  EXPECT_EQ(QosOverrides{}.over(code), code);
  EXPECT_EQ(QosOverrides{.reliability = Reliability::best_effort}.over(code),
            QoS(7).transient_local().deadline(5ms).best_effort());
  EXPECT_EQ((QosOverrides{.profile = *qos_profile("sensor_data"), .depth = 3}.over(code)),
            QoS(3).best_effort());
}

TEST(QoS, RefusesADepthThatARingCannotHold) {
  EXPECT_THAT([] { QoS(0).check(); },
              ThrowsMessage<Error>(
                  "a history of 0 messages cannot be kept; choose a depth from 1 to 16384"));
  EXPECT_THAT([] { QoS(16385).check(); },
              ThrowsMessage<Error>(
                  "a history of 16385 messages cannot be kept; choose a depth from 1 to 16384"));
  EXPECT_NO_THROW(QoS(1).check());
  EXPECT_NO_THROW(QoS().keep_all().check());
  EXPECT_THAT(
      [] { QoS().lifespan(-1ns).check(); },
      ThrowsMessage<Error>("a lifespan of -1ns cannot be kept; choose one above 0, or 0 for none"));
  EXPECT_NO_THROW(QoS(KeepLastRing<int>::kMaxDepth).check());
}

// "For ever" as the longest duration was less than none at all, and did not match it.
TEST(QoS, OfTheLongestDurationIsOfNone) {
  constexpr Nanoseconds kHundredYears = std::chrono::hours(24 * 36525);
  for (const Nanoseconds endless : {Nanoseconds::max(), kHundredYears}) {
    EXPECT_EQ(QoS().refuses(QoS().deadline(endless)), "");
    EXPECT_EQ(QoS().deadline(endless).refuses(QoS()), "");
    EXPECT_EQ(QoS().refuses(QoS().liveliness_lease_duration(endless)), "");
    EXPECT_EQ(QoS().deadline(endless).refuses(QoS().deadline(std::chrono::seconds(1))), "deadline");
  }
}

}  // namespace
}  // namespace takt
