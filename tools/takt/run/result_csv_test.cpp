// SPDX-License-Identifier: Apache-2.0
#include "run/result_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/measuring/run.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

rt::Run run() {
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
  rt::Run run = rt::run_of(process);
  run.file = "robot.yaml";
  run.executor = "events";
  run.repeat = 1;
  return run;
}

TEST(ResultCsv, HasALineForEachValueWithItsSampleSizeAndRunLength) {
  const std::string text = result_csv({run()}, true);
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
    rt::Run of_others = run();
    of_others.processes[0].name = begin + "cmd|' /C calc'!A0";
    EXPECT_THAT(result_csv({of_others}, true), HasSubstr("process,'" + begin + "cmd|"));
  }
  rt::Run negative = run();
  negative.processes[0].cpu_percent = -1.5;
  EXPECT_THAT(result_csv({negative}, true), HasSubstr("cpu_percent,,,,-1.5,\n"));
}

TEST(ResultCsv, HasTheLimitsOfTheBuckets) {
  const std::string text = result_csv({run()}, true);
  EXPECT_THAT(text, HasSubstr("latency_us bucket,2,9.983,10.239,1,\n"));
  EXPECT_THAT(text, HasSubstr("latency_us bucket,2,29.695,30.207,1,\n"));
}

TEST(ResultCsv, HasTheRatiosWithTheirIntervals) {
  Compared ratio{.row = {"robot.yaml", "events"}, .other = "static", .figure = "p99"};
  ratio.ratio = {.value = 0.75, .low = 0.5, .high = 1.0, .repeats = 10};
  ratio.decision.verdict = rt::Verdict::open;
  ratio.seconds = 2.5;
  EXPECT_THAT(
      result_csv({run()}, true, std::vector{ratio}),
      HasSubstr("robot.yaml,events,file,file,file,,2.5,ratio,,static,p99,10,0.5,1.0,0.75,open\n"));
}

}  // namespace
}  // namespace takt::tools
