// SPDX-License-Identifier: Apache-2.0
#include "run/verdicts.hpp"

#include <cmath>
#include <fstream>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/temporary.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// A run with one subscription, whose one latency is so many µs, and one thread.
rt::Run run_of(const std::string& executor, std::uint64_t repeat, double us,
               std::uint64_t misses = 0, const std::string& file = "robot.yaml") {
  ProcessResult process;
  process.duration_s = 1;
  process.cpu_percent = 10;
  process.callbacks.resize(1);
  CallbackStatistics& statistics = process.callbacks[0].statistics;
  statistics.kind = EntityKind::subscription;
  statistics.received = 1;
  statistics.deadline_misses = misses;
  statistics.latency.record(Nanoseconds(std::llround(us * 1e3)));
  rt::Run run = rt::run_of(process);
  run.file = file;
  run.executor = executor;
  run.repeat = repeat;
  return run;
}

/// Repeats in which the machine becomes slower; `events` takes 0.8 times as long as `static`.
std::vector<rt::Run> runs_of_two(std::uint64_t repeats) {
  std::vector<rt::Run> runs;
  for (std::uint64_t i = 0; i < repeats; ++i) {
    const double us = 100 * static_cast<double>(1 + i);
    runs.push_back(run_of("static", i, us));
    runs.push_back(run_of("events", i, 0.8 * us * (i % 2 == 0 ? 1.01 : 0.99)));
  }
  return runs;
}

json document_of(json runs) {
  json document = json::object();
  document["runs"] = std::move(runs);
  return document;
}

json json_of(const std::vector<rt::Run>& runs) {
  return rt::result_document(runs).at("runs");
}

std::vector<std::string> figures_of(const std::vector<Compared>& all) {
  std::vector<std::string> names;
  for (const Compared& each : all) names.push_back(each.figure);
  return names;
}

TEST(Verdicts, AreOfPairsAgainstTheFirstRow) {
  const std::vector<Compared> all = compare_rows(runs_of_two(8), {});
  // Nothing was missed, so there is no ratio of misses.
  EXPECT_THAT(figures_of(all), testing::ElementsAre("p50", "p99", "max", "cpu_%"));
  EXPECT_EQ(all[0].row.executor, "events");
  EXPECT_EQ(all[0].other, "static");
  EXPECT_NEAR(all[0].ratio.value, 0.8, 0.001);
  EXPECT_LT(all[0].ratio.high - all[0].ratio.low, 0.02);  // although the machine became slower
  EXPECT_EQ(all[0].decision.verdict, rt::Verdict::real);
  EXPECT_EQ(all[0].samples, 8u);
  EXPECT_EQ(all[3].decision.verdict, rt::Verdict::same);
  EXPECT_EQ(
      sentence(all),
      "events: p50 is 0.80 (0.79 to 0.81) of static, p99 0.80 (0.79 to 0.81), max 0.80 (0.79 to "
      "0.81): real. The same: cpu_% within 0.0 %.");
}

/// A second thread may be what makes the difference.
TEST(Verdicts, NameWhatElseThanTheExecutorDiffers) {
  std::vector<rt::Run> runs = runs_of_two(8);
  for (rt::Run& run : runs) {
    run.executors.push_back({.name = "default", .type = run.executor});
    run.threads.resize(run.executor == "events" ? 2 : 1, {.executor = "default"});
  }
  EXPECT_THAT(sentence(compare_rows(runs, {})),
              HasSubstr(": real, and so differ threads 2 against 1."));
}

TEST(Verdicts, AreAgainstTheRowThatIsNamed) {
  const std::vector<Compared> all = compare_rows(runs_of_two(8), {"events", {}});
  EXPECT_EQ(all[0].row.executor, "static");
  EXPECT_NEAR(all[0].ratio.value, 1.25, 0.001);
}

TEST(Verdicts, BelowSixRepeatsThereIsNone) {
  const std::vector<Compared> all = compare_rows(runs_of_two(5), {});
  ASSERT_FALSE(all.empty());
  for (const Compared& each : all) EXPECT_EQ(each.decision.verdict, rt::Verdict::none);
  EXPECT_TRUE(compare_rows(runs_of_two(1), {}).empty());
}

TEST(Verdicts, AreOfEachFileAlone) {
  std::vector<rt::Run> runs = runs_of_two(6);
  for (std::uint64_t i = 0; i < 6; ++i) runs.push_back(run_of("static", i, 5, 0, "other.yaml"));
  for (const Compared& each : compare_rows(runs, {})) EXPECT_EQ(each.row.file, "robot.yaml");
}

TEST(Verdicts, OfMissesCountHalfAMissMore) {
  std::vector<rt::Run> runs;
  for (std::uint64_t i = 0; i < 8; ++i) {
    runs.push_back(run_of("static", i, 100, 0));
    runs.push_back(run_of("events", i, 100, 2));
  }
  const std::vector<Compared> all = compare_rows(runs, {});
  ASSERT_EQ(all.front().figure, "misses");
  EXPECT_NEAR(all.front().ratio.value, 5, 1e-9);  // 2.5 to 0.5
}

/// Half a count in 20 ms is 15 times the rate of half a count in 300 ms: "misses is 8.00: real".
TEST(Verdicts, OfCountsAreLeftOutIfTheRunsDifferInLength) {
  std::vector<rt::Run> stored, runs;
  for (std::uint64_t i = 0; i < 8; ++i) {
    stored.push_back(run_of("events", i, 100, i == 0 ? 1 : 0));
    runs.push_back(run_of("events", i, 100));
    runs.back().duration_s = 0.05;
  }
  std::vector<Compared> all = compare_rows(runs, {"base", stored});
  EXPECT_THAT(figures_of(all), testing::ElementsAre("p50", "p99", "max", "cpu_%"));
  EXPECT_EQ(lengths_note(all),
            "runs of events (base) took 1.00 s, of events 0.05 s: the longer a run, the larger its "
            "maximum; counts (misses, wakeups/s) are left out\n");
  for (rt::Run& run : runs) run.duration_s = 0.95;
  all = compare_rows(runs, {"base", stored});
  EXPECT_EQ(all.front().figure, "misses");
  EXPECT_EQ(lengths_note(all), "");
}

TEST(Verdicts, LeaveOutARunWithoutItsPair) {
  std::vector<rt::Run> runs = runs_of_two(8);
  runs.pop_back();  // interrupted
  EXPECT_EQ(compare_rows(runs, {}).front().ratio.repeats, 7u);
}

class Stored : public testing::Test {
 protected:
  std::string store(const json& document) {
    const std::string path = folder_ / "before.json";
    std::ofstream(path) << document;
    return path;
  }
  const std::vector<RowName> rows_{{"robot.yaml", "static"}, {"robot.yaml", "events"}};

 private:
  const TemporaryFolder folder_;
};

TEST_F(Stored, RunsAreComparedRowByRowAndNotInPairs) {
  std::vector<rt::Run> before = runs_of_two(8);
  for (rt::Run& run : before) run.file = "old_name.yaml";
  const Against against = find_against(store(document_of(json_of(before))), rows_);
  const std::vector<Compared> all = compare_rows(runs_of_two(7), against);
  EXPECT_EQ(all.front().row.executor, "static");
  EXPECT_THAT(all.front().other, testing::StartsWith("static ("));
  EXPECT_EQ(all.front().ratio.repeats, 7u);
  EXPECT_EQ(all.front().ratio.other_repeats, 8u);
  EXPECT_EQ(all.back().row.executor, "events");
}

TEST_F(Stored, OneRowStandsForAll) {
  std::vector<rt::Run> before;
  for (std::uint64_t i = 0; i < 6; ++i) before.push_back(run_of("isolated", i, 100));
  const Against against = find_against(store(document_of(json_of(before))), rows_);
  EXPECT_THAT(compare_rows(runs_of_two(6), against).front().other, HasSubstr("isolated"));
}

/// Another system was compared without a word, by the figures that both have.
TEST_F(Stored, RunsOfAnotherSystemAreNoted) {
  const auto chain = [](rt::Run run) {
    run.chains.push_back({.name = "joint"});
    return run;
  };
  const std::vector<rt::Run> stored{chain(run_of("events", 0, 100, 0, "lidar.yaml"))};
  const std::vector<rt::Run> runs{run_of("events", 0, 100), run_of("events", 1, 100)};
  EXPECT_THAT(
      stored_notes(runs, {"before", stored}),
      testing::ElementsAre("before was stored of lidar.yaml, and is compared with robot.yaml",
                           "events: before has figures that these runs lack: joint misses"));
  EXPECT_THAT(stored_notes({chain(run_of("events", 0, 100, 0, "./robot.yaml"))}, {"b", runs}),
              testing::ElementsAre("events: b lacks figures of these runs: joint misses"));
  EXPECT_TRUE(stored_notes(runs, {"before", runs}).empty());
  EXPECT_TRUE(stored_notes(runs, {}).empty());
}

/// "p50 (7 of 6 repeats)": the stored side had too few.
TEST_F(Stored, TooFewRepeatsAreCalledStored) {
  const std::vector<Compared> all = compare_rows(runs_of_two(7), {"before", runs_of_two(3)});
  ASSERT_FALSE(all.empty());
  EXPECT_THAT(sentence(std::span(all).first(1)),
              HasSubstr("No verdict: p50 (3 of 6 stored repeats)"));
  const std::vector<Compared> other = compare_rows(runs_of_two(3), {"before", runs_of_two(7)});
  EXPECT_THAT(sentence(std::span(other).first(1)), HasSubstr("No verdict: p50 (3 of 6 repeats)"));
}

TEST_F(Stored, RunsMustHaveEachRow) {
  std::vector<rt::Run> before = runs_of_two(6);
  for (rt::Run& run : before) {
    if (run.executor == "events") run.executor = "isolated";
  }
  EXPECT_THAT([&] { find_against(store(document_of(json_of(before))), rows_); },
              ThrowsMessage<Error>(testing::AllOf(HasSubstr("nothing is stored of 'events'"),
                                                  HasSubstr("valid: static, isolated"))));
}

TEST_F(Stored, RunsOfAnEarlierTaktAreOfOneExecutorForAll) {
  json before = json_of(runs_of_two(8));
  for (json& run : before) run.erase("placement");
  const std::string path = store(document_of(before));
  EXPECT_THAT([&] { find_against(path, rows_); },
              ThrowsMessage<Error>(HasSubstr("compare with --placement merged")));
  std::vector<RowName> merged = rows_;
  for (RowName& row : merged) row.placement = "merged";
  EXPECT_EQ(find_against(path, merged).name, path);
  // The file's own placement was always kept.
  for (json& run : before) run["executor"] = run.at("executor") == "events" ? "file" : "other";
  EXPECT_NO_THROW(
      find_against(store(document_of(before)), std::vector<RowName>{{"robot.yaml", "file"}}));
}

/// What later versions have added is not asked of them; all else is.
TEST_F(Stored, RunsOfAnEarlierTaktLackKeys) {
  json before = json_of(runs_of_two(6));
  for (json& run : before) {
    for (const char* key : {"placement", "releases", "executors", "topics", "notes"})
      run.erase(key);
    for (const char* key : {"from_outside", "skipped", "waiting_us", "take_us", "lost"}) {
      run["callbacks"][0].erase(key);
    }
    run["processes"][0].erase("allocations_in_dds");
    run["executor"] = "file";
  }
  const std::vector<RowName> rows{{"robot.yaml", "file"}};
  EXPECT_EQ(find_against(store(document_of(before)), rows).stored->size(), before.size());
  before[3]["callbacks"][0].erase("received");
  EXPECT_THAT([&] { find_against(store(document_of(before)), rows); },
              ThrowsMessage<Error>(HasSubstr("runs[3].callbacks[0] has no 'received'")));
}

TEST_F(Stored, AnythingElseIsRefused) {
  for (const json& document : {json::array(), json(3), document_of(3), document_of(json::array()),
                               document_of(json::array({document_of(3)}))}) {
    EXPECT_THROW(find_against(store(document), rows_), Error) << document;
  }
  const json spoiled = rt::run_json(run_of("static", 0, 100));
  for (const auto& [key, value] : spoiled.items()) {
    if (key == "releases") continue;  // computed
    json run = spoiled;
    run[key] = "nonsense";
    if (value.is_string()) run[key] = 1;
    EXPECT_THROW(find_against(store(document_of(json::array({run}))), rows_), Error) << key;
  }
}

/// They were read: -1 misses as 2^64 - 1, and a run of no length as one without figures.
TEST_F(Stored, NumbersThatCannotBeAreRefusedByName) {
  const std::vector<std::pair<json::json_pointer, json>> spoilt{
      {"/duration_s"_json_pointer, 0},
      {"/duration_s"_json_pointer, -1.5},
      {"/repeat"_json_pointer, -1},
      {"/callbacks/0/received"_json_pointer, -3},
      {"/callbacks/0/deadline_misses"_json_pointer, 0.5},
      {"/callbacks/0/latency_us/histogram/0/0"_json_pointer, -1},
      {"/callbacks/0/latency_us/histogram/0/0"_json_pointer, 1152},
      {"/callbacks/0/latency_us/histogram/0/1"_json_pointer, -1},
      {"/callbacks/0/latency_us/count"_json_pointer, -1},
      {"/callbacks/0/latency_us/min"_json_pointer, 1e9}};
  for (const auto& [where, value] : spoilt) {
    json run = rt::run_json(run_of("static", 1, 100));
    ASSERT_TRUE(run.contains(where)) << where;
    run[where] = value;
    const std::string path =
        store(document_of(json::array({rt::run_json(run_of("static", 0, 100)), run})));
    EXPECT_THAT([&] { find_against(path, rows_); },
                ThrowsMessage<Error>(testing::AllOf(HasSubstr(path), HasSubstr("runs[1]."),
                                                    HasSubstr(value.dump()))))
        << where;
  }
}

TEST(Against, AWrongNameIsAnsweredByTheRightOnes) {
  const std::vector<RowName> rows{{"robot.yaml", "static"}, {"robot.yaml", "events", "edf"}};
  EXPECT_THAT([&] { find_against("evnts", rows); },
              ThrowsMessage<Error>(testing::AllOf(HasSubstr("evnts.compared.json"),
                                                  HasSubstr("valid: static, events edf"))));
  EXPECT_FALSE(find_against("events", rows).stored);
  EXPECT_FALSE(find_against("events edf", rows).stored);
  EXPECT_EQ(find_against("", rows).name, "");
}

TEST(Against, StoredRunsHaveAFileOfTheirName) {
  EXPECT_EQ(stored_path("before"), "before.compared.json");
  EXPECT_EQ(stored_path("results/before"), "results/before.compared.json");
  EXPECT_EQ(stored_path("/tmp/x.json"), "/tmp/x.json");
}

}  // namespace
}  // namespace takt::tools
