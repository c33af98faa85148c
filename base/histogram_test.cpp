// Tests of the duration histogram.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/histogram.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

std::vector<std::pair<std::size_t, std::uint64_t>> buckets_of(const Histogram& histogram) {
  std::vector<std::pair<std::size_t, std::uint64_t>> result;
  histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
    result.emplace_back(bucket, count);
  });
  return result;
}

std::size_t bucket_of(Nanoseconds value) {
  Histogram histogram;
  histogram.record(value);
  return buckets_of(histogram).at(0).first;
}

// Log-uniform, so that every bucket is as likely as any other.
std::vector<Nanoseconds> random_durations(std::size_t count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(0.0, 39.9);
  std::vector<Nanoseconds> result;
  for (std::size_t i = 0; i < count; ++i) {
    result.emplace_back(static_cast<std::int64_t>(std::exp2(exponent(random))));
  }
  return result;
}

TEST(Histogram, IsZeroWhileEmpty) {
  const Histogram histogram;
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.min(), 0ns);
  EXPECT_EQ(histogram.max(), 0ns);
  EXPECT_EQ(histogram.mean(), 0ns);
  EXPECT_EQ(histogram.percentile(0.99), 0ns);
  EXPECT_TRUE(buckets_of(histogram).empty());
}

TEST(Histogram, KnowsMinimumMaximumAndMeanExactly) {
  Histogram histogram;
  for (const Nanoseconds value : {1'000'003ns, 5ns, 999'998ns}) histogram.record(value);
  EXPECT_EQ(histogram.count(), 3u);
  EXPECT_EQ(histogram.min(), 5ns);
  EXPECT_EQ(histogram.max(), 1'000'003ns);
  EXPECT_EQ(histogram.mean(), 666'668ns);
}

TEST(Histogram, ReturnsAPercentileAtMostThreePointTwoPercentTooHighAndNeverTooLow) {
  std::vector<Nanoseconds> values = random_durations(5000);
  Histogram histogram;
  for (const Nanoseconds value : values) histogram.record(value);
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(fraction * 5000.0));
    const Nanoseconds exact = values[std::max<std::size_t>(rank, 1) - 1];
    const Nanoseconds reported = histogram.percentile(fraction);
    EXPECT_GE(reported, exact) << fraction;
    EXPECT_LE(static_cast<double>(reported.count()), static_cast<double>(exact.count()) * 1.032)
        << fraction;
  }
}

TEST(Histogram, ReturnsASingleSampleExactlyAtEveryPercentile) {
  Histogram histogram;
  histogram.record(123'457ns);
  EXPECT_EQ(histogram.percentile(0.0), 123'457ns);
  EXPECT_EQ(histogram.percentile(0.5), 123'457ns);
  EXPECT_EQ(histogram.percentile(1.0), 123'457ns);
}

TEST(Histogram, HasBucketsThatMeetWithoutGapOrOverlap) {
  for (std::size_t bucket = 0; bucket + 1 < Histogram::kBuckets; ++bucket) {
    const Nanoseconds limit = Histogram::upper_limit(bucket);
    ASSERT_EQ(bucket_of(limit), bucket);
    ASSERT_EQ(bucket_of(limit + 1ns), bucket + 1);
  }
}

TEST(Histogram, CountsNegativeDurationsInTheFirstBucket) {
  Histogram histogram;
  histogram.record(-5ns);
  EXPECT_EQ(buckets_of(histogram), (std::vector<std::pair<std::size_t, std::uint64_t>>{{0, 1}}));
  EXPECT_EQ(histogram.min(), 0ns);
  EXPECT_EQ(histogram.max(), 0ns);
}

TEST(Histogram, CountsWhatIsTooLongInTheLastBucketAndKeepsTheMaximumExact) {
  Histogram histogram;
  const Nanoseconds hour = 1h;
  histogram.record(1ns);
  histogram.record(hour);
  EXPECT_EQ(buckets_of(histogram).back().first, Histogram::kBuckets - 1);
  EXPECT_EQ(histogram.max(), hour);
  EXPECT_EQ(histogram.percentile(1.0), Nanoseconds((std::int64_t{1} << 40) - 1));
}

TEST(Histogram, MergedIsAsIfOneHadRecordedAll) {
  const std::vector<Nanoseconds> values = random_durations(300);
  Histogram all, first, second;
  for (std::size_t i = 0; i < values.size(); ++i) {
    all.record(values[i]);
    (i % 3 == 0 ? first : second).record(values[i]);
  }
  first.merge(second);
  EXPECT_EQ(buckets_of(first), buckets_of(all));
  EXPECT_EQ(first.count(), all.count());
  EXPECT_EQ(first.min(), all.min());
  EXPECT_EQ(first.max(), all.max());
  EXPECT_EQ(first.mean(), all.mean());
}

TEST(Histogram, MergingAnEmptyOneChangesNothing) {
  Histogram histogram;
  histogram.record(40ns);
  histogram.merge(Histogram());
  EXPECT_EQ(histogram.count(), 1u);
  EXPECT_EQ(histogram.min(), 40ns);
  EXPECT_EQ(histogram.max(), 40ns);
}

TEST(Histogram, ReadBackFromItsBucketsHasTheSameBuckets) {
  Histogram original;
  for (const Nanoseconds value : random_durations(300)) original.record(value);
  Histogram read_back;
  for (const auto& [bucket, count] : buckets_of(original)) read_back.add_bucket(bucket, count);
  EXPECT_EQ(buckets_of(read_back), buckets_of(original));
  EXPECT_EQ(read_back.count(), original.count());
  EXPECT_EQ(read_back.percentile(0.5), original.percentile(0.5));
  EXPECT_EQ(read_back.max(), Histogram::upper_limit(buckets_of(original).back().first));
}

TEST(Histogram, IgnoresBucketsThatDoNotExistAndEmptyOnes) {
  Histogram histogram;
  histogram.add_bucket(Histogram::kBuckets, 3);
  histogram.add_bucket(4, 0);
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.max(), 0ns);
}

// Buckets of 64 bits were 37 kB for each callback, four fifths of a node's memory.
TEST(Histogram, TakesLessThanFiveKilobytes) {
  EXPECT_LE(sizeof(Histogram), 4750u);  // four of them: 19 kB
}

TEST(Histogram, KeepsCountAndMeanExactAndSaysSoWhenABucketIsFull) {
  Histogram histogram;
  histogram.add_bucket(4, Histogram::kFull - 1);
  histogram.record(1us);
  EXPECT_FALSE(histogram.is_saturated());
  for (int i = 0; i < 3; ++i) histogram.record(4ns);  // one has a place
  EXPECT_TRUE(histogram.is_saturated());
  EXPECT_EQ(histogram.count(), std::uint64_t{Histogram::kFull} + 3);
  EXPECT_EQ(histogram.sum(), 4ns * (std::int64_t{Histogram::kFull} + 2) + 1us);
  EXPECT_EQ(buckets_of(histogram).front().second, Histogram::kFull);
  EXPECT_EQ(histogram.percentile(0.999), 4ns);
  EXPECT_EQ(histogram.percentile(1.0), 1us);
}

TEST(Histogram, MergedOrReadBackSaturatesInsteadOfBeginningAtZeroAgain) {
  Histogram histogram;
  histogram.add_bucket(4, Histogram::kFull - 1);
  histogram.add_bucket(5, std::uint64_t{Histogram::kFull} + 7);
  Histogram other = histogram;
  other.merge(histogram);
  EXPECT_TRUE(other.is_saturated());
  EXPECT_EQ(other.count(), 2 * histogram.count());
  EXPECT_EQ(buckets_of(other), (std::vector<std::pair<std::size_t, std::uint64_t>>{
                                   {4, Histogram::kFull}, {5, Histogram::kFull}}));
  Histogram read_back;
  for (const auto& [bucket, count] : buckets_of(other)) read_back.add_bucket(bucket, count);
  read_back.set_exact(other.count(), other.min(), other.max(), other.sum());
  EXPECT_TRUE(read_back.is_saturated());
  EXPECT_EQ(read_back.count(), other.count());
  EXPECT_EQ(read_back.mean(), other.mean());
}

TEST(Histogram, KeepsTheLargestSumOfNumbersThatAreTooLarge) {
  Histogram histogram;
  histogram.add_bucket(Histogram::kBuckets - 1, UINT64_MAX);
  EXPECT_EQ(histogram.sum(), Nanoseconds::max());
  histogram.merge(Histogram(histogram));
  EXPECT_EQ(histogram.sum(), Nanoseconds::max());
}

TEST(Histogram, RecordsWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const std::vector<Nanoseconds> values = random_durations(100);
  Histogram histogram;
  const RealtimeScope scope;
  for (const Nanoseconds value : values) histogram.record(value);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(histogram.count(), 100u);
}

}  // namespace
}  // namespace takt
