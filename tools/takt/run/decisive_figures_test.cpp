// SPDX-License-Identifier: Apache-2.0
#include "run/decisive_figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/measuring/run.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

std::vector<std::string> names_of(const std::vector<Figure>& figures) {
  std::vector<std::string> names;
  for (const Figure& figure : figures) names.push_back(figure.name);
  return names;
}

const Figure& find(const std::vector<Figure>& figures, const std::string& name) {
  return *std::find_if(figures.begin(), figures.end(),
                       [&name](const Figure& figure) { return figure.name == name; });
}

TEST(DecisiveFigures, AreInTheOrderOfTheTableThenOfTheChains) {
  ProcessResult process;
  process.duration_s = 2;
  process.cpu_percent = 7.5;
  process.callbacks.resize(2);
  process.callbacks[0].statistics.kind = EntityKind::timer;
  process.callbacks[0].statistics.latency.record(3ms);
  CallbackStatistics& subscription = process.callbacks[1].statistics;
  subscription.kind = EntityKind::subscription;
  subscription.received = 100;
  subscription.deadline_misses = 3;
  for (int i = 1; i <= 100; ++i) subscription.latency.record(i * 10us);
  process.chains.push_back({.name = "joint"});
  process.chains[0].statistics.instances = 50;
  process.chains[0].statistics.latency.record(1ms);
  process.threads.resize(1);
  process.threads[0].statistics.counters.voluntary_switches = 400;
  const std::vector<Figure> figures = decisive_figures(rt::run_of(process));
  EXPECT_THAT(names_of(figures),
              testing::ElementsAre("misses", "p50", "p99", "max", "timer_p99", "cpu_%", "wakeups/s",
                                   "joint misses", "joint p50", "joint p99"));
  EXPECT_DOUBLE_EQ(find(figures, "misses").value, 3.5 / 2);  // by the second, with half a count
  EXPECT_FALSE(find(figures, "misses").is_zero);
  EXPECT_EQ(find(figures, "misses").samples, 100u);
  EXPECT_NEAR(find(figures, "p50").value, 500, 500 * 0.032);
  EXPECT_DOUBLE_EQ(find(figures, "max").value, 1000);
  EXPECT_EQ(find(figures, "p99").samples, 100u);
  EXPECT_DOUBLE_EQ(find(figures, "timer_p99").value, 3000);
  EXPECT_DOUBLE_EQ(find(figures, "cpu_%").value, 7.5);
  EXPECT_FALSE(find(figures, "cpu_%").samples);
  EXPECT_DOUBLE_EQ(find(figures, "wakeups/s").value, 400.5 / 2);
  EXPECT_TRUE(find(figures, "joint misses").is_zero);
  EXPECT_TRUE(find(figures, "misses").is_count);
  EXPECT_TRUE(find(figures, "wakeups/s").is_count);
  EXPECT_FALSE(find(figures, "cpu_%").is_count);
  EXPECT_DOUBLE_EQ(find(figures, "joint p50").value, 1000);
}

TEST(DecisiveFigures, WithoutASampleThereIsNoPercentile) {
  ProcessResult process;
  process.duration_s = 1;
  EXPECT_THAT(names_of(decisive_figures(rt::run_of(process))),
              testing::ElementsAre("misses", "cpu_%", "wakeups/s"));
  process.duration_s = 0;
  EXPECT_TRUE(decisive_figures(rt::run_of(process)).empty());
}

/// As limits of buckets, figures of two runs were equal, or 3 % apart.
TEST(InterpolatedUs, TellsTimesWithinABucketApart) {
  Histogram low, high;  // 1000 samples each; the buckets of both are the same
  for (int i = 0; i < 1000; ++i) {
    low.record(i < 600 ? 100us : 200us);
    high.record(i < 900 ? 100us : 200us);
  }
  EXPECT_EQ(low.percentile(0.5), high.percentile(0.5));
  EXPECT_GT(interpolated_us(low, 0.5), interpolated_us(high, 0.5));
  EXPECT_NEAR(interpolated_us(low, 0.5), 100, 3.2);
  EXPECT_DOUBLE_EQ(interpolated_us(low, 1), 200);  // never above the maximum
  Histogram one;
  one.record(123'457ns);
  EXPECT_DOUBLE_EQ(interpolated_us(one, 0.5), 123.457);
  EXPECT_DOUBLE_EQ(interpolated_us(Histogram(), 0.5), 0);
}

}  // namespace
}  // namespace takt::tools
