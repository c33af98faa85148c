// Tests of the timeline: compares all events.
// SPDX-License-Identifier: Apache-2.0
#include "run/trace.hpp"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

rt::Run run(const std::vector<rt::Run::Traced>& threads) {
  rt::Run run{.file = "robot.yaml", .duration_s = 2.5, .trace = threads};
  run.callbacks.push_back({.executor = "all"});
  run.callbacks[0].statistics.node = "/node";
  run.callbacks[0].statistics.callback = "tick";
  run.callbacks.push_back({.executor = "all"});  // as one adds up what was removed
  run.callbacks[1].statistics.callback = "(other removed callbacks)";
  run.chains.push_back({.name = "c"});
  run.chains[0].statistics.latency.record(Nanoseconds(1000));
  return run;
}

/// From 0 to 1 ms of CLOCK_MONOTONIC; the clock loses 1 us meanwhile.
TraceFrame frame() {
  return {.clock = "mono_raw",
          .begin = TimePoint(Nanoseconds(0)),
          .end = TimePoint(Nanoseconds(1'000'000)),
          .begin_offset = Nanoseconds(7'000'000'000'000'000'000),
          .end_offset = Nanoseconds(6'999'999'999'999'999'000)};
}
const TraceFrame kFrame{.end = TimePoint(Nanoseconds(1'000'000))};

Trace trace_of(const std::vector<rt::Run::Traced>& threads) {
  return make_trace(
      run(threads), false, [](const rt::Run::Traced&) { return false; }, kFrame);
}

std::string path_of_file() {
  return testing::TempDir() + "trace_test.json";
}

json written(const std::vector<rt::Run::Traced>& threads) {
  std::filesystem::remove(path_of_file());  // which another test may have read
  write_trace(trace_of(threads), path_of_file());
  json document = json::parse(std::ifstream(path_of_file()));
  std::filesystem::remove(path_of_file());
  return document;
}

/// In the format of rt::run_of.
json execution(const char* name, const char* kind, int sequence, int chain, int lost, int ready,
               int picked, int start, int end, int path = 0, int cause = 0) {
  return json::array({name, kind, sequence, chain, lost, ready, picked, start, end, end - start - 1,
                      path, cause, false});
}
rt::Run::Traced thread(int tid, const std::vector<json>& executions,
                       std::uint64_t overwritten = 0) {
  return {.process = "robot",
          .executor = "all",
          .executor_type = "events",
          .scheduler = "fifo",
          .thread = "worker",
          .tid = tid,
          .overwritten = overwritten,
          .events = executions};
}

/// Callback and times in ns of each execution, and which one has caused it.
std::vector<std::string> lines_of(const Trace& trace) {
  std::vector<std::string> result;
  for (const TracedExecution& one : trace.executions) {
    result.push_back(fmt::format(
        "{} {} {} {} {} {} {} {} {} by {}", trace.threads[one.thread].tid, one.callback, one.kind,
        one.lost, one.ready.count(), one.picked.count(), one.start.count(), one.end.count(),
        one.cpu_time.count(), one.cause ? std::to_string(*one.cause) : "-"));
  }
  return result;
}

TEST(TraceFile, HasASliceForAnExecutionAndOneForItsTimeInTheQueue) {
  const json document = written(
      {thread(7, {execution("/node tick", "timer", 5, 5, 0, 10'000, 12'000, 12'500, 14'000)}, 3)});
  json expected = json::parse(R"({
    "displayTimeUnit": "ns",
    "otherData": {"overwritten_executions": 3, "file": "robot.yaml", "duration_s": 2.5, "clock": "monotonic", "begin_ns": 10000,
                  "callbacks": ["/node/tick"], "modes": [], "active_nodes": [],
                  "executors": {"all": {"type": "events", "scheduler": "fifo", "callbacks": ["/node/tick"]}}},
    "traceEvents": [
      {"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "robot"}},
      {"ph": "M", "pid": 1, "tid": 7, "name": "thread_name",
       "args": {"name": "worker", "overwritten": 3, "is_prompt": false}},
      {"ph": "X", "pid": 1, "tid": 7, "name": "/node tick", "cat": "timer", "ts": 2.5, "dur": 1.5,
       "args": {"number": 0, "latency_us": 2.5, "waiting_us": 2.0, "take_us": 0.5, "cpu_us": 1.499, "waited": false,
                "lost": 0, "sequence": 5, "chain_instance": 5}},
      {"ph": "b", "pid": 1, "tid": 7, "name": "ready: /node tick", "cat": "ready", "id": 0, "ts": 0.0},
      {"ph": "e", "pid": 1, "tid": 7, "name": "ready: /node tick", "cat": "ready", "id": 0, "ts": 2.0}
    ]})");
  expected["otherData"]["machine"] = document["otherData"]["machine"];
  expected["otherData"]["chains"] = document["otherData"]["chains"];
  EXPECT_EQ(document["otherData"]["chains"][0]["latency_us"]["p99"], 1);
  EXPECT_FALSE(document["otherData"]["chains"][0]["latency_us"].contains("histogram"));
  EXPECT_EQ(document, expected);
}

TEST(TraceFile, HasAMarkWhereAModeCameIntoForce) {
  rt::Run with_modes =
      run({thread(7, {execution("/node tick", "timer", 5, 5, 0, 10'000, 12'000, 12'500, 14'000)})});
  with_modes.mode_switches = {
      {.mode = "early", .cause = "c", .begin_ns = 8'000, .end_ns = 9'000, .process = "robot"},
      {.mode = "degraded",
       .cause = "'robot/loop' has overrun",
       .begin_ns = 12'600,
       .end_ns = 12'900,
       .process = "robot"}};
  write_trace(make_trace(
                  with_modes, false, [](const rt::Run::Traced&) { return false; }, kFrame),
              path_of_file());
  const json document = json::parse(std::ifstream(path_of_file()));
  std::filesystem::remove(path_of_file());
  EXPECT_EQ(document["otherData"]["modes"], json::array({"degraded", "early"}));
  std::vector<json> marks;
  for (const json& event : document["traceEvents"]) {
    if (event.value("cat", "") == "mode") marks.push_back(event);
  }
  EXPECT_EQ(marks, std::vector<json>{json::parse(R"(
      {"ph": "i", "s": "p", "pid": 1, "cat": "mode", "ts": 2.9,
       "name": "mode 'degraded': 'robot/loop' has overrun",
       "args": {"mode": "degraded", "begin_us": 2.6}})")});
}

TEST(TraceFile, HasAnArrowFromEachStepOfAChainInstanceToTheNext) {
  const json document =
      written({thread(7, {execution("first", "timer", 5, 5, 0, 0, 900, 1000, 2000),
                          execution("third", "subscription", 9, 5, 0, 4000, 4900, 5000, 6000),
                          execution("other", "timer", 6, 6, 0, 0, 6900, 7000, 8000)}),
               thread(8, {execution("second", "subscription", 7, 5, 0, 0, 2900, 3000, 4000)})});
  std::vector<std::string> arrows;
  for (const json& event : document.at("traceEvents")) {
    if (event.at("name") != "chain") continue;
    arrows.push_back(event.at("ph").get<std::string>() + " " + event.at("tid").dump() + " " +
                     event.at("ts").dump());
  }
  EXPECT_THAT(arrows, testing::ElementsAre("s 7 1.0", "t 8 3.0", "f 7 5.0"));
}

// An hour of the boot time in ns is more than a double has digits for, so times count from a begin.
TEST(TraceFile, SaysItsClockAndTheTimeOfItsBegin) {
  const Trace trace = make_trace(
      run({thread(7, {execution("a", "timer", 5, 5, 0, 500'000, 500'000, 600'000, 700'000)})}),
      false, [](const rt::Run::Traced&) { return false; }, frame());
  EXPECT_EQ(trace.about.at("clock"), "mono_raw");
  EXPECT_EQ(trace.about.at("begin_ns"), 7'000'000'000'000'499'500);
  EXPECT_EQ(trace.executions[0].start, Nanoseconds(99'900));
  EXPECT_EQ(trace.executions[0].end, Nanoseconds(199'800));
}

TEST(TraceFile, CountsWhatWaitsWhereThatIsMoreThanOne) {
  const json document =
      written({thread(7, {execution("/a/in", "subscription", 5, 5, 0, 0, 3000, 3000, 4000),
                          execution("/a/in", "subscription", 6, 6, 0, 1000, 4000, 4000, 5000),
                          execution("/b/in", "subscription", 7, 7, 0, 2000, 5000, 5000, 6000)})});
  std::vector<std::string> counts;
  for (const json& event : document.at("traceEvents")) {
    if (event.at("ph") != "C") continue;
    counts.push_back(event.at("name").get<std::string>() + " " + event.at("ts").dump() + " " +
                     event.at("args").at("waiting").dump());
  }
  EXPECT_THAT(counts, testing::ElementsAre("waiting: /a/in 0.0 1", "waiting: /a/in 1.0 2",
                                           "waiting: /a/in 3.0 1", "waiting: /a/in 4.0 0"));
}

TEST(TraceFile, HasARowForEachCpuAndMarksWakeUps) {
  TraceFrame frame = kFrame;
  const auto add = [&](int time, int cpu, std::uint32_t from, std::uint32_t to, bool is_wakeup) {
    Scheduling::Event event;
    event.time = TimePoint(Nanoseconds(time));
    event.cpu = cpu;
    event.thread = from;
    event.next_thread = to;
    event.was_preempted = to == 9;
    event.is_wakeup = is_wakeup;
    frame.scheduling.events.push_back(event);
  };
  add(1000, 1, 0, 8, false);  // before the first execution
  add(2500, 1, 8, 7, true);
  add(3000, 1, 8, 7, false);
  add(4000, 1, 7, 9, false);
  add(5000, 1, 9, 0, false);
  frame.scheduling.names = {{7, "worker"}, {8, "other"}};
  frame.scheduling.missing = "something, as it may not";
  const Trace trace = make_trace(
      run({thread(7, {execution("a", "timer", 5, 5, 0, 2000, 2100, 2200, 4500)})}), false,
      [](const rt::Run::Traced&) { return false; }, frame);
  std::filesystem::remove(path_of_file());
  write_trace(trace, path_of_file());
  const json document = json::parse(std::ifstream(path_of_file()));
  std::vector<std::string> rows;
  for (const json& event : document.at("traceEvents")) {
    if (event.value("cat", "") != "sched" && event.at("pid") != 2) continue;
    rows.push_back(fmt::format("{} {} {} {} {} {}", event.at("ph").get<std::string>(),
                               event.value("tid", -1), event.at("name").get<std::string>(),
                               event.value("ts", -1.0), event.value("dur", -1.0),
                               event.contains("args") ? event.at("args").dump() : ""));
  }
  EXPECT_THAT(rows,
              testing::ElementsAre(R"(M -1 process_name -1 -1 {"name":"Linux"})",
                                   R"(M 1 thread_name -1 -1 {"name":"CPU 1"})",
                                   R"(i 7 woken by other 0.5 -1 {"by":8,"cpu":1})",
                                   R"(X 1 other 0 1 {"preempted":false,"tid":8})",
                                   R"(X 1 worker 1 1 {"preempted":true,"tid":7})",
                                   R"(X 1 thread 9 2 1 {"preempted":false,"tid":9})",
                                   R"(M 2 thread_name -1 -1 {"name":"something, as it may not"})",
                                   "i 2 something, as it may not 0 -1 "));
  EXPECT_EQ(lines_of(read_trace(path_of_file())), lines_of(trace));
  std::filesystem::remove(path_of_file());
}

TEST(TraceFile, MarksWhatWasLostBeforeAnExecution) {
  const json document =
      written({thread(7, {execution("sub", "subscription", 5, 5, 4, 0, 0, 0, 9)})});
  EXPECT_EQ(
      document.at("traceEvents").back(),
      json({{"ph", "i"}, {"pid", 1}, {"tid", 7}, {"name", "sub lost 4"}, {"ts", 0.0}, {"s", "t"}}));
}

// Twice on one path: the second one began after the message was published.
const std::vector<rt::Run::Traced> kCaused{
    thread(7, {execution("/a/tick", "timer", 1, 1, 0, 1'000, 1'000, 1'010, 1'100, 77),
               execution("/b/in", "subscription", 2, 1, 2, 1'050, 1'100, 1'200, 1'300, 78, 77),
               execution("/b/in", "subscription", 3, 1, 0, 1'060, 1'300, 1'400, 1'500, 78, 77)}),
    thread(8,
           {execution("/c/in", "subscription", 4, 1, 0, 1'290, 1'500, 1'600, 1'700, 79, 78),
            execution("/d/in", "subscription", 5, 1, 0, 1'290, 1'700, 1'800, 1'900, 80, 99)},
           6)};

TEST(Trace, KnowsWhichExecutionPublishedTheMessageOfAnother) {
  EXPECT_THAT(lines_of(trace_of(kCaused)),
              testing::ElementsAre("7 /a/tick timer 0 0 0 10 100 89 by -",
                                   "7 /b/in subscription 2 50 100 200 300 99 by 0",
                                   "7 /b/in subscription 0 60 300 400 500 99 by 0",
                                   "8 /c/in subscription 0 290 500 600 700 99 by 1",
                                   "8 /d/in subscription 0 290 700 800 900 99 by -"));
}

TEST(Trace, IsReadAsItWasWritten) {
  const Trace trace = trace_of(kCaused);
  std::filesystem::remove(path_of_file());  // which another test may have read
  write_trace(trace, path_of_file());
  const Trace read = read_trace(path_of_file());
  std::filesystem::remove(path_of_file());
  EXPECT_EQ(lines_of(read), lines_of(trace));
  ASSERT_EQ(read.threads.size(), 2u);
  EXPECT_EQ(read.threads[1].overwritten, 6u);
  EXPECT_EQ(read.threads[1].process, "robot");
  EXPECT_EQ(read.about.at("callbacks"), json::array({"/node/tick"}));
}

TEST(TraceFile, ThatCannotBeWrittenIsAnError) {
  EXPECT_THAT([] { write_trace({.about = json::object()}, "/nowhere/trace.json"); },
              ThrowsMessage<Error>(HasSubstr("the file cannot be written")));
}

TEST(TraceFile, ThatIsNoneIsAnError) {
  EXPECT_THAT([] { read_trace("/nowhere/trace.json"); },
              ThrowsMessage<Error>("/nowhere/trace.json: the file cannot be read: No such file or "
                                   "directory; check its name and its permissions"));
  for (const char* text : {"", "[1]", "{}", R"({"traceEvents": [], "otherData": {}})",
                           R"({"traceEvents": [{"ph": "X", "pid": 1}], "otherData": {}})"}) {
    std::ofstream(path_of_file()) << text;
    EXPECT_THAT([] { read_trace(path_of_file()); },
                ThrowsMessage<Error>(HasSubstr("this is not a trace of this version of Takt")));
  }
  json document = written(kCaused);
  for (json& event : document.at("traceEvents")) {
    if (event.at("ph") == "X" && event.at("args").contains("caused_by")) {
      event["args"]["caused_by"] = 5;  // there are five, from 0
    }
  }
  std::ofstream(path_of_file()) << document;
  EXPECT_THAT([] { read_trace(path_of_file()); },
              ThrowsMessage<Error>(HasSubstr("this is not a trace of this version of Takt")));
  std::filesystem::remove(path_of_file());
}

}  // namespace
}  // namespace takt::tools
