// Tests of the statistics of callbacks and threads that have gone.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/past_statistics.hpp"

#include <string>

#include <gtest/gtest.h>
#include <malloc.h>

#include "takt/executors/engine/numbers.hpp"

namespace takt::detail {
namespace {

using namespace std::chrono_literals;

CallbackStatistics row(const std::string& node, Nanoseconds latency) {
  CallbackStatistics result;
  result.node = node;
  result.callback = "tick";
  result.received = result.expected = 1;
  for (Histogram* times : {&result.latency, &result.waiting, &result.take, &result.execution}) {
    times->record(latency);
    latency *= 2;
  }
  return result;
}

TEST(FilledBuckets, GiveTheWholeHistogramBack) {
  Histogram histogram;
  for (const Nanoseconds sample : {5ns, 3001ns, 3001ns, 40'003ns, 17'000'000ns}) {
    histogram.record(sample);
  }
  Histogram sum;
  FilledBuckets(histogram).add_to(sum);
  for (const double fraction : {0.0, 0.2, 0.5, 0.7, 0.99, 1.0}) {
    EXPECT_EQ(sum.percentile(fraction), histogram.percentile(fraction));
  }
  EXPECT_EQ(sum.count(), 5u);
  EXPECT_EQ(sum.sum(), histogram.sum());
  EXPECT_EQ(sum.min(), 5ns);
  EXPECT_EQ(sum.max(), 17'000'000ns);
}

TEST(PastStatistics, ACallbackThatComesAgainGoesOnWithItsRow) {
  PastStatistics past;
  past.add(row("/node", 3us));
  past.add(row("/other", 5us));
  past.add(row("/node", 7us));
  const auto rows = past.with({row("/other", 11us)});
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].node, "/other");
  EXPECT_EQ(rows[0].latency.count(), 2u);
  EXPECT_EQ(rows[1].node, "/node");
  EXPECT_EQ(rows[1].received, 2u);
  EXPECT_EQ(rows[1].latency.min(), 3us);
  EXPECT_EQ(rows[1].waiting.max(), 14us);
  EXPECT_EQ(rows[1].take.sum(), 40us);
  EXPECT_EQ(rows[1].execution.max(), 56us);
}

// 256 rows of 37 kB were kept, the first ones for ever.
TEST(PastStatistics, KeepsTheLastHundredRowsAndTheSumOfTheRest) {
  PastStatistics past;
  past.add(row("/again", 1ms));
  for (int i = 0; i < 300; ++i) past.add(row("/node" + std::to_string(i), 1us));
  past.add(row("/again", 1us));
  const auto rows = past.with({});
  ASSERT_EQ(rows.size(), PastStatistics::kMost + 1);
  EXPECT_EQ(rows[0].node, "/node201");
  EXPECT_EQ(rows[98].node, "/node299");
  EXPECT_EQ(rows[99].node, "/again");  // it went last; its first life is in the sum
  EXPECT_EQ(rows[99].received, 1u);
  EXPECT_EQ(rows[100].callback, PastStatistics::kOthers);
  EXPECT_EQ(rows[100].received, 202u);
  EXPECT_EQ(rows[100].latency.count(), 202u);
  EXPECT_EQ(rows[100].latency.max(), 1ms);
}

TEST(PastStatistics, TakesTheMemoryOfTheFilledBucketsOnly) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers have allocators of their own";
#endif
  const auto before = mallinfo2().uordblks;
  PastStatistics past;
  for (int i = 0; i < 1000; ++i) past.add(row("/node" + std::to_string(i), 1us));
  EXPECT_LT(mallinfo2().uordblks, before + 150'000);  // 100 rows
}

TEST(PastThreads, KeepsTheLastHundredRowsAndTheSumOfTheRest) {
  PastThreads past(/*trace_events=*/2);
  const auto thread = [](const std::string& name) {
    ThreadStatistics result;
    result.asked.name = result.in_force.name = name;
    result.cpu_time = 1ms;
    result.spin_time = 1us;
    result.trace.resize(2);
    return result;
  };
  for (int i = 0; i < 300; ++i) past.add(thread("thread" + std::to_string(i)));
  past.add(thread("thread299"));
  const auto rows = past.with({thread("thread250")});
  ASSERT_EQ(rows.size(), PastStatistics::kMost + 1);
  EXPECT_EQ(rows[0].asked.name, "thread250");
  EXPECT_EQ(rows[0].cpu_time, 2ms);
  EXPECT_EQ(rows[99].asked.name, "thread299");
  EXPECT_EQ(rows[99].cpu_time, 2ms);
  EXPECT_EQ(rows[99].trace.size(), 2u);  // it grew with each life
  EXPECT_EQ(rows[99].trace_overwritten, 2u);
  EXPECT_EQ(rows[100].asked.name, PastThreads::kOthers);
  EXPECT_EQ(rows[100].cpu_time, 200ms);
  EXPECT_EQ(rows[100].spin_time, 200us);  // merging had forgotten it
  EXPECT_TRUE(rows[100].trace.empty());
  EXPECT_EQ(rows[100].trace_overwritten, 400u);
}

// Each group and node had a number of its own for ever, and `round_robin` an array as long as the
// largest.
TEST(Numbers, OfWhatHasGoneAreGivenAgain) {
  Numbers<int> numbers;
  const auto first = std::make_shared<int>();
  auto second = std::make_shared<int>();
  int keys[4];
  numbers.of(&keys[0]).alive = first;
  numbers.of(&keys[1]).alive = second;
  EXPECT_EQ(numbers.of(&keys[0]).number, 0u);
  EXPECT_EQ(numbers.of(&keys[1]).number, 1u);
  second.reset();
  numbers.forget_gone();
  EXPECT_EQ(numbers.size(), 1u);
  EXPECT_EQ(numbers.of(&keys[2]).number, 1u);
  EXPECT_EQ(numbers.of(&keys[3]).number, 2u);
}

}  // namespace
}  // namespace takt::detail
