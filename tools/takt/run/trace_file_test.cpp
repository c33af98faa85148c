// Tests of the timeline: compares all events.
// SPDX-License-Identifier: Apache-2.0
#include "run/trace_file.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

json written(const std::vector<json>& threads) {
  const std::filesystem::path path = testing::TempDir() + "trace_file_test.json";
  write_trace(threads, path);
  json document = json::parse(std::ifstream(path));
  std::filesystem::remove(path);
  return document;
}

/// In the format of process_json.
json execution(const char* name, const char* kind, int sequence, int chain, int lost, int ready,
               int picked, int start, int end) {
  return json::array({name, kind, sequence, chain, lost, ready, picked, start, end});
}
json thread(int tid, const std::vector<json>& executions, int overwritten = 0) {
  return {{"process", "robot"},
          {"thread", "worker"},
          {"tid", tid},
          {"overwritten", overwritten},
          {"events", executions}};
}

TEST(TraceFile, HasASliceForAnExecutionAndOneForItsTimeInTheQueue) {
  const json document = written(
      {thread(7, {execution("/node tick", "timer", 5, 5, 0, 10'000, 12'000, 12'500, 14'000)}, 3)});
  EXPECT_EQ(document, json::parse(R"({
    "displayTimeUnit": "ns",
    "otherData": {"overwritten_executions": 3},
    "traceEvents": [
      {"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "robot"}},
      {"ph": "M", "pid": 1, "tid": 7, "name": "thread_name", "args": {"name": "worker"}},
      {"ph": "X", "pid": 1, "tid": 7, "name": "/node tick", "cat": "timer", "ts": 2.5, "dur": 1.5,
       "args": {"latency_us": 2.5, "waiting_us": 2.0, "take_us": 0.5, "sequence": 5, "chain_instance": 5}},
      {"ph": "b", "pid": 1, "tid": 7, "name": "ready: /node tick", "cat": "ready", "id": 0, "ts": 0.0},
      {"ph": "e", "pid": 1, "tid": 7, "name": "ready: /node tick", "cat": "ready", "id": 0, "ts": 2.0}
    ]})"));
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

TEST(TraceFile, MarksWhatWasLostBeforeAnExecution) {
  const json document =
      written({thread(7, {execution("sub", "subscription", 5, 5, 4, 0, 0, 0, 9)})});
  EXPECT_EQ(
      document.at("traceEvents").back(),
      json({{"ph", "i"}, {"pid", 1}, {"tid", 7}, {"name", "sub lost 4"}, {"ts", 0.0}, {"s", "t"}}));
}

TEST(TraceFile, ThatCannotBeWrittenIsAnError) {
  EXPECT_THAT([] { write_trace(json::array(), "/nowhere/trace.json"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("the trace could not be written")));
}

}  // namespace
}  // namespace takt::tools
