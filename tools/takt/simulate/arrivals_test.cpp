// What comes from outside of a simulation, and how much may happen in it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/arrivals.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using analysis::ArrivalCurve;

constexpr TimePoint kFirst{5s};

std::vector<TimePoint> arrivals_of(const ArrivalCurve& curve, std::size_t count) {
  Arrivals arrivals(curve, kFirst);
  std::vector<TimePoint> times;
  for (; times.size() < count; arrivals.take()) times.push_back(arrivals.next());
  return times;
}

/// The first so many arrivals in a row that come in less time than the curve permits; 0: none.
std::size_t first_too_close(const ArrivalCurve& curve) {
  const std::vector<TimePoint> times = arrivals_of(curve, 1200);
  for (std::size_t count = 2; count <= times.size(); ++count) {
    const Nanoseconds least(curve.least_distance(static_cast<analysis::Count>(count)));
    for (std::size_t i = 0; i + count <= times.size(); ++i)
      if (times[i + count - 1] - times[i] < least) return count;
  }
  return 0;
}

// Where more than 1,024 might come at once, they did so for ever.
TEST(Arrivals, AreAsEarlyAsTheirCurvePermits) {
  const ArrivalCurve bursts = ArrivalCurve::periodic(1'000'000, 1'100'000'000, 30'000);
  for (const ArrivalCurve& curve :
       {bursts, ArrivalCurve::periodic(1000, 5'000'000), ArrivalCurve::periodic(1000),
        ArrivalCurve::periodic(1000, 300, 2000), ArrivalCurve::by_distances({0, 100}),
        ArrivalCurve::by_distances({3, 8, 40}).with_jitter(500).with_least_distance(2)}) {
    EXPECT_EQ(first_too_close(curve), 0u);
    const std::vector<TimePoint> times = arrivals_of(curve, 2500);
    for (std::size_t i = 0; i < times.size(); ++i)
      ASSERT_EQ((times[i] - kFirst).count(), curve.least_distance(std::int64_t(i) + 1));
  }
  const std::vector<TimePoint> times = arrivals_of(bursts, 2500);
  EXPECT_EQ(std::count_if(times.begin(), times.end(),
                          [](TimePoint time) { return time < later(kFirst, 1s); }),
            bursts.most(1'000'000'000));
}

// Distances that do not add up to those of more arrivals: then they come later than one may think.
TEST(Arrivals, KeepDistancesThatDoNotAddUp) {
  for (const ArrivalCurve& curve :
       {ArrivalCurve::by_distances({5, 5}), ArrivalCurve::by_distances({1, 1, 50, 51}),
        ArrivalCurve::by_distances({1, 1, 50, 51}).with_least_distance(10),
        ArrivalCurve::by_distances({1, 30, 31, 80}).with_jitter(45).with_least_distance(20)})
    EXPECT_EQ(first_too_close(curve), 0u);
}

}  // namespace
}  // namespace takt::tools
