// Tests of results as JSON; that they keep their schema, results_test.py proves.
// SPDX-License-Identifier: Apache-2.0
#include "run/result_json.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/measuring/row_json.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

ProcessResult result_of_one_callback() {
  ProcessResult result;
  result.name = "robot";
  result.callbacks.emplace_back();
  result.callbacks[0].executor = "all";
  result.callbacks[0].statistics.node = "/node";
  result.callbacks[0].statistics.callback = "tick";
  result.callbacks[0].statistics.kind = EntityKind::timer;
  return result;
}

json json_of(const ProcessResult& result) {
  return rt::run_json(rt::run_of(result));
}

Histogram read_histogram(const json& written) {
  Histogram read;
  rt::read_value(written, read, {nullptr, "latency_us"});
  return read;
}

TEST(ResultJson, SaysNullOfTimesWithoutASample) {
  const json callback = json_of(result_of_one_callback()).at("callbacks").at(0);
  EXPECT_EQ(callback.at("process"), "robot");
  EXPECT_EQ(callback.at("node"), "/node");
  EXPECT_EQ(callback.at("kind"), "timer");
  EXPECT_EQ(callback.at("latency_us"),
            json::parse(R"({"count": 0, "sum": null, "mean": null, "min": null,
    "p50": null, "p90": null, "p99": null, "p999": null, "max": null, "histogram": []})"));
}

TEST(ResultJson, SaysEachPercentileByItsName) {
  ProcessResult result = result_of_one_callback();
  result.chains.push_back({.name = "chain"});
  CallbackStatistics& statistics = result.callbacks[0].statistics;
  for (int i = 1; i <= 10'000; ++i) {
    statistics.latency.record(i * 1us);
    statistics.waiting.record(i * 2us);
    statistics.take.record(i * 3us);
    statistics.execution.record(i * 4us);
    result.chains[0].statistics.latency.record(i * 5us);
  }
  statistics.latency.record(1s);  // far from the percentile before it
  const auto expect = [](const json& written, const Histogram& histogram) {
    EXPECT_EQ(written.at("count"), histogram.count());
    for (const auto& [key, fraction] :
         {std::pair("p50", 0.5), {"p90", 0.9}, {"p99", 0.99}, {"p999", 0.999}, {"max", 1.0}}) {
      EXPECT_EQ(rt::from_us(written.at(key)), histogram.percentile(fraction)) << key;
    }
    EXPECT_EQ(rt::from_us(written.at("min")), histogram.min());
    EXPECT_EQ(rt::from_us(written.at("mean")), histogram.mean());
    EXPECT_EQ(rt::from_us(written.at("sum")), histogram.sum());
  };
  const json run = json_of(result);
  const json callback = run.at("callbacks").at(0);
  expect(callback.at("latency_us"), statistics.latency);
  expect(callback.at("waiting_us"), statistics.waiting);
  expect(callback.at("take_us"), statistics.take);
  expect(callback.at("execution_us"), statistics.execution);
  expect(run.at("chains").at(0).at("latency_us"), result.chains[0].statistics.latency);
}

TEST(ResultJson, ReleasesAreThoseOfAllTimers) {
  ProcessResult result = result_of_one_callback();
  result.callbacks.push_back(result.callbacks[0]);
  result.callbacks.push_back(result.callbacks[0]);
  result.callbacks[0].statistics.received = 30;
  result.callbacks[0].statistics.skipped = 10;
  result.callbacks[0].statistics.overruns = 17;  // with those of the budget
  result.callbacks[1].statistics.received = 60;
  result.callbacks[2].statistics.kind = EntityKind::subscription;
  result.callbacks[2].statistics.received = 500;
  const rt::Run::Releases releases = rt::run_of(result).releases();
  EXPECT_EQ(releases.due, 100u);
  EXPECT_EQ(releases.served, 90u);
}

TEST(ResultJson, KeepsAHistogramWhole) {
  ProcessResult result = result_of_one_callback();
  Histogram& latency = result.callbacks[0].statistics.latency;
  for (const Nanoseconds sample : {3001ns, 3001ns, 40'003ns}) latency.record(sample);
  const json written = json_of(result).at("callbacks").at(0).at("latency_us");
  const Histogram read = read_histogram(written);
  EXPECT_EQ(read.count(), 3u);
  EXPECT_EQ(read.percentile(0.5), latency.percentile(0.5));
  // Exactly: from the limits of the buckets, each would be up to 3.2 % too high.
  EXPECT_EQ(read.min(), 3001ns);
  EXPECT_EQ(read.max(), 40'003ns);
  EXPECT_EQ(read.sum(), 46'005ns);
  EXPECT_EQ(read.mean(), latency.mean());
}

TEST(ResultJson, MarksAHistogramWithAFullBucketAndKeepsItsCount) {
  ProcessResult result = result_of_one_callback();
  Histogram& latency = result.callbacks[0].statistics.latency;
  latency.record(1ms);
  EXPECT_FALSE(json_of(result).at("callbacks").at(0).at("latency_us").contains("saturated"));
  latency.add_bucket(4, std::uint64_t{Histogram::kFull} + 2);
  const json written = json_of(result).at("callbacks").at(0).at("latency_us");
  EXPECT_EQ(written.at("saturated"), true);
  EXPECT_EQ(read_histogram(written).count(), std::uint64_t{Histogram::kFull} + 3);
  EXPECT_TRUE(read_histogram(written).is_saturated());
}

TEST(ResultJson, LostIsWhatWasSentAndNeitherReceivedNorDropped) {
  ProcessResult result = result_of_one_callback();
  CallbackStatistics& statistics = result.callbacks[0].statistics;
  statistics.kind = EntityKind::subscription;
  statistics.expected = 17;
  statistics.received = 9;
  statistics.dropped = 3;
  EXPECT_EQ(json_of(result).at("callbacks").at(0).at("lost"), 5);
  EXPECT_EQ(json_of(result).at("callbacks").at(0).at("late"), json());  // no known period
  statistics.late = 2;
  EXPECT_EQ(json_of(result).at("callbacks").at(0).at("late"), 2);
}

TEST(ResultJson, SaysNullOfAllocationsThatNobodyCounted) {
  ProcessResult result;
  result.allocations_while_spinning = 5;
  result.allocations_counted = false;
  EXPECT_EQ(json_of(result).at("processes").at(0).at("allocations_while_spinning"), json());
  result.allocations_counted = true;
  EXPECT_EQ(json_of(result).at("processes").at(0).at("allocations_while_spinning"), 5);
}

TEST(ResultJson, IsWrittenToAFileAsItIs) {
  const std::string path = testing::TempDir() + "result_json_test.json";
  write_json({{"runs", {1, 2}}}, path);
  EXPECT_EQ(json::parse(std::ifstream(path)), json({{"runs", {1, 2}}}));
  std::remove(path.c_str());
}

TEST(ResultJson, CannotBeWrittenWhereThereIsNoFolder) {
  EXPECT_THAT([] { write_json({}, "/nowhere/results.json"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere/results.json: the file cannot be written")));
}

}  // namespace
}  // namespace takt::tools
