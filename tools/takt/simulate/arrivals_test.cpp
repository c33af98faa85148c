// What comes from outside of a simulation, and how much may happen in it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/arrivals.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/simulation/simulation.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using analysis::ArrivalCurve;
using ::testing::HasSubstr;

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

// ---- How much may happen ----

std::string error_of(const std::string& executor, const std::string& more) {
  const std::string text = fmt::format(R"(
machine: {{cpus: 1, rt_runtime: unlimited}}
threads: {{one: {{affinity: [0]}}}}
executors: {{e: {{{}, threads: [one]}}}}
container:
  components:
    - {{component: takt::Workload, name: n, executor: e, {}}}
)",
                                       executor, more);
  try {
    const Simulation simulation(ConfigurationFile("system.yaml", text).read(),
                                {.overrides = {}, .measured = {}, .duration = 10s});
    simulation.run({});
  } catch (const Error& refused) {
    return refused.what();
  }
  return {};
}

TEST(Simulation, ABusySecondEndsIt) {
  const std::string timer =
      "parameters: {publishers: {topic: [t], period_us: [10000], work_us: [1]}}";
  EXPECT_EQ(error_of("type: triggered, let: 1ms", timer), "");
  EXPECT_THAT(error_of("type: triggered, let: 999ns", timer),
              HasSubstr("system.yaml:4: cannot simulate executor 'e': `let: 999ns` has more than "
                        "1000000 periods in a second; let it be at least 1us"));
  // Each message to itself makes the next one.
  EXPECT_THAT(error_of("type: events",
                       "parameters: {relays: {input: [t], output: [t], work_us: [0]}}, callbacks: "
                       "{t: {execution: 1ns, arrival: {period: 5s}}}"),
              HasSubstr("cannot simulate more than 1000000 executions and arrivals in a second, "
                        "as of '/n/t'; let less come at once"));
}

}  // namespace
}  // namespace takt::tools
