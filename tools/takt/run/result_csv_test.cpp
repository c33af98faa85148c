// SPDX-License-Identifier: Apache-2.0
#include "run/result_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/measuring/process_json.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json document() {
  ProcessResult process;
  process.name = "robot";
  process.duration_s = 2.5;
  process.callbacks.resize(1);
  CallbackStatistics& statistics = process.callbacks[0].statistics;
  statistics.kind = EntityKind::subscription;
  statistics.node = "/front";
  statistics.callback = "scan, \"raw\"";
  statistics.received = 2;
  statistics.latency.record(10us);
  statistics.latency.record(30us);
  json run = rt::process_json(process);
  run["file"] = "robot.yaml";
  run["executor"] = "events";
  run["placement"] = run["scheduler"] = run["composition"] = "file";
  run["repeat"] = 1;
  json document = json::object();
  document["runs"] = json::array({run});
  return document;
}

TEST(ResultCsv, HasALineForEachValueWithItsSampleSizeAndRunLength) {
  const std::string text = result_csv(document());
  EXPECT_THAT(text,
              testing::StartsWith("file,executor,placement,scheduler,composition,repeat,seconds,"
                                  "of,process,name,figure,n,from,to,value,verdict\n"));
  // A name with a comma stays one cell.
  const std::string callback =
      "robot.yaml,events,file,file,file,1,2.5,subscription,robot,\"/front/scan, \"\"raw\"\"\",";
  EXPECT_THAT(text, HasSubstr(callback + "received,2,,,2,\n"));
  EXPECT_THAT(text, HasSubstr(callback + "latency_us max,2,,,30.0,\n"));
  EXPECT_THAT(text, HasSubstr("process,robot,robot,cpu_percent,,,,0.0,\n"));
  EXPECT_THAT(text, Not(HasSubstr("waiting_us p50")));  // without a sample
}

// A spreadsheet would run it.
TEST(ResultCsv, HasNoNameThatIsAFormula) {
  for (const std::string begin : {"=", "+", "-", "@"}) {
    json of_others = document();
    of_others["runs"][0]["processes"][0]["name"] = begin + "cmd|' /C calc'!A0";
    EXPECT_THAT(result_csv(of_others), HasSubstr("process,'" + begin + "cmd|"));
  }
  json negative = document();
  negative["runs"][0]["processes"][0]["cpu_percent"] = -1.5;
  EXPECT_THAT(result_csv(negative), HasSubstr("cpu_percent,,,,-1.5,\n"));
}

TEST(ResultCsv, HasTheLimitsOfTheBuckets) {
  const std::string text = result_csv(document());
  EXPECT_THAT(text, HasSubstr("latency_us bucket,2,9.983,10.239,1,\n"));
  EXPECT_THAT(text, HasSubstr("latency_us bucket,2,29.695,30.207,1,\n"));
}

TEST(ResultCsv, HasTheRatiosWithTheirIntervals) {
  json with_ratio = document();
  with_ratio["ratios"] = json::array({json{{"file", "robot.yaml"},
                                           {"executor", "events"},
                                           {"placement", "file"},
                                           {"scheduler", "file"},
                                           {"composition", "file"},
                                           {"against", "static"},
                                           {"figure", "p99"},
                                           {"ratio", 0.75},
                                           {"low", 0.5},
                                           {"high", 1.0},
                                           {"repeats", 10},
                                           {"duration_s", 2.5},
                                           {"verdict", "open"}}});
  EXPECT_THAT(
      result_csv(with_ratio),
      HasSubstr("robot.yaml,events,file,file,file,,2.5,ratio,,static,p99,10,0.5,1.0,0.75,open\n"));
}

}  // namespace
}  // namespace takt::tools
