// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/arrival_curve.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/analysis/supply.hpp"
#include "takt/base/error.hpp"

namespace takt::analysis {
namespace {

using ::testing::ElementsAre;

std::vector<Count> most(const ArrivalCurve& curve, std::initializer_list<Time> windows) {
  std::vector<Count> result;
  for (const Time window : windows) result.push_back(curve.most(window));
  return result;
}

TEST(ArrivalCurve, CountsInHalfOpenWindows) {
  EXPECT_THAT(most(ArrivalCurve::periodic(10), {0, 1, 10, 11, 20, 21}),
              ElementsAre(0, 1, 1, 2, 2, 3));
  EXPECT_THAT(most(ArrivalCurve::periodic(10, 5), {0, 1, 5, 6, 15, 16}),
              ElementsAre(0, 1, 1, 2, 2, 3));
  EXPECT_THAT(most(ArrivalCurve::periodic(10, 25, 2), {1, 2, 3, 5, 6}), ElementsAre(1, 1, 2, 3, 3));
}

TEST(ArrivalCurve, GoesOnAfterItsDistances) {
  const ArrivalCurve bursts = ArrivalCurve::by_distances({1, 10});  // two close, then a pause
  EXPECT_THAT(most(bursts, {1, 2, 10, 11, 12, 20, 21}), ElementsAre(1, 2, 2, 3, 4, 4, 5));
  EXPECT_EQ(bursts.least_distance(4), 11);
  EXPECT_THAT(bursts.steps(12), ElementsAre(0, 1, 10, 11));
}

TEST(ArrivalCurve, ALongJitterHasAsFewSteps) {
  EXPECT_THAT(ArrivalCurve::periodic(10, 4'000'000'000'000'003).steps(25), ElementsAre(0, 7, 17));
}

TEST(ArrivalCurve, DistancesAndCountsAgree) {
  for (const ArrivalCurve& curve :
       {ArrivalCurve::periodic(7), ArrivalCurve::periodic(7, 20), ArrivalCurve::periodic(9, 30, 2),
        ArrivalCurve::by_distances({0, 5, 5, 12}),
        ArrivalCurve::by_distances({3, 4}).with_jitter(5)}) {
    for (Count count = 1; count < 50; ++count) {
      EXPECT_GE(curve.most(curve.least_distance(count) + 1), count);
      EXPECT_LT(curve.most(curve.least_distance(count)), count);
    }
  }
}

TEST(ArrivalCurve, RefusesWhatIsNoCurve) {
  EXPECT_THROW(ArrivalCurve::periodic(0), Error);
  EXPECT_THROW(ArrivalCurve::by_distances({}), Error);
  EXPECT_THROW(ArrivalCurve::by_distances({3, 2}), Error);
  EXPECT_THROW(ArrivalCurve::by_distances({0, 0}), Error);
}

std::vector<Time> times_for(const Supply& supply, Time most) {
  std::vector<Time> result;
  for (Time work = 0; work <= most; ++work) result.push_back(supply.time_for(work, 1000));
  return result;
}

TEST(Supply, OfAReservationAsPublished) {
  EXPECT_THAT(times_for(Supply(Reservation{3, 5}, nullptr), 7),
              ElementsAre(0, 5, 6, 7, 10, 11, 12, 15));
  EXPECT_EQ(Supply(Reservation{4, 10}, nullptr).time_for(5, 1000), 23);
}

TEST(Supply, IsWhatMoreUrgentThreadsLeave) {
  const ArrivalCurve curve = ArrivalCurve::periodic(5);
  const Supply rest([&](Time window) { return 2 * curve.most(window); }, false);
  EXPECT_THAT(times_for(rest, 5), ElementsAre(0, 3, 4, 5, 8, 9));
  const Supply nothing([&](Time window) { return 5 * curve.most(window); }, false);
  EXPECT_EQ(nothing.time_for(1, 1000), kUnbounded);
}

}  // namespace
}  // namespace takt::analysis
