// From traces to a model: what is measured, and what is not concluded.
// SPDX-License-Identifier: Apache-2.0
#include "model/extraction.hpp"

#include <filesystem>

#include <gmock/gmock.h>

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

/// A trace of one thread in the making.
struct Made : Trace {
  explicit Made(double duration_s = 10) {
    about = {{"file", "robot.yaml"},       {"machine", "a robot"},
             {"duration_s", duration_s},   {"executors", json::object()},
             {"callbacks", json::array()}, {"chains", json::array()}};
    threads.push_back({.process = "p", .name = "worker", .tid = 7, .is_prompt = true});
  }
  /// Starts when it is ready.
  TracedExecution& add(const std::string& callback, Nanoseconds ready, Nanoseconds cpu_time) {
    executions.push_back({.callback = callback,
                          .kind = "timer",
                          .ready = ready,
                          .picked = ready,
                          .start = ready,
                          .end = ready + cpu_time + 1us,
                          .cpu_time = cpu_time});
    return executions.back();
  }
};

MeasuredModel model_of(const Trace& trace) {
  return extract_model({&trace, 1});
}

/// A timer that is up to 400 µs late.
Made periodic() {
  Made trace;
  for (int i = 0; i < 100; ++i) {
    trace.add("/a/tick", i * 10ms + (i % 5) * 100us, 1ms + i * 10us);
  }
  return trace;
}

TEST(Extraction, MeasuresExecutionsInCpuTime) {
  const MeasuredModel model = model_of(periodic());
  ASSERT_EQ(model.callbacks.size(), 1u);
  const MeasuredCallback& tick = model.callbacks[0];
  EXPECT_EQ(tick.name, "/a/tick");
  EXPECT_EQ(tick.executions, 100u);
  EXPECT_EQ(tick.least_execution, 1ms);
  EXPECT_EQ(tick.median_execution, 1500us);
  EXPECT_EQ(tick.p99_execution, 1990us);
  EXPECT_EQ(tick.longest_execution, 1990us);
  EXPECT_EQ(tick.longest_first_execution, 1090us);
  EXPECT_EQ(model.file, "robot.yaml");
  EXPECT_EQ(model.machine, "a robot");
  EXPECT_EQ(model.duration, 10s);
}

// The thread decodes it before the callback: 8 MB were no work.
TEST(Extraction, AMessageOfAnotherProcessIsReadInTheExecution) {
  Made trace;
  trace.threads.push_back({.process = "q", .name = "worker", .tid = 8});
  trace.add("/a/tick", 0ms, 1ms);
  trace.add("/b/in", 1ms, 1ms).cause = 0;
  trace.add("/q/in", 1ms, 1ms).cause = 0;
  trace.executions[2].thread = 1;
  for (TracedExecution& execution : trace.executions) execution.picked -= 500us;
  for (std::size_t i : {1u, 2u}) trace.executions[i].kind = "subscription";
  const MeasuredModel model = model_of(trace);
  ASSERT_EQ(model.callbacks.size(), 3u);
  EXPECT_EQ(model.callbacks[0].longest_execution, 1ms);
  EXPECT_EQ(model.callbacks[1].longest_execution, 1ms);
  EXPECT_EQ(model.callbacks[2].longest_execution, 1500us);
}

TEST(Extraction, MeasuresTheClosestArrivalsAndAPeriod) {
  const MeasuredCallback tick = model_of(periodic()).callbacks[0];
  ASSERT_EQ(tick.least_distances.size(), MeasuredCallback::kMostDistances);
  EXPECT_EQ(tick.least_distances[0], 9600us);   // from the latest to the earliest
  EXPECT_EQ(tick.least_distances[3], 39900us);  // four steps on, it is 100 µs earlier
  EXPECT_EQ(tick.least_distances[4], 50ms);
  EXPECT_NEAR(static_cast<double>(tick.period.count()), 10e6, 5e3);
  EXPECT_GE(tick.jitter, 400us);
  for (std::size_t i = 0; i < tick.least_distances.size(); ++i) {
    EXPECT_GE(tick.least_distances[i],
              static_cast<std::int64_t>(i + 1) * tick.period - tick.jitter);
  }
}

TEST(Extraction, FindsNoPeriodWhereThereIsNone) {
  Made trace;
  Nanoseconds time{0};
  for (int i = 0; i < 100; ++i) trace.add("/a/in", time += (i % 2 == 0 ? 1ms : 30ms), 1ms);
  const MeasuredCallback in = model_of(trace).callbacks[0];
  EXPECT_EQ(in.period, 0ns);
  EXPECT_EQ(in.jitter, 0ns);
  EXPECT_EQ(in.least_distances[0], 1ms);
  EXPECT_EQ(in.least_distances[1], 31ms);
}

TEST(Extraction, BridgesNoLostArrivals) {
  Made trace;
  for (const auto time : {0ms, 10ms, 20ms, 50ms, 60ms}) trace.add("/a/in", time, 1ms);
  trace.executions[3].lost = 2;
  const MeasuredCallback in = model_of(trace).callbacks[0];
  EXPECT_EQ(in.dropped, 2u);
  EXPECT_THAT(in.least_distances, ElementsAre(10ms, 20ms));
}

// What another thread of the process did before may be lost, too.
TEST(Extraction, BeginsWhereTheTraceOfAProcessIsComplete) {
  Made trace;
  trace.threads.push_back({.process = "p", .name = "other", .tid = 8, .overwritten = 5});
  trace.threads.push_back({.process = "q", .name = "else", .tid = 9});
  for (int i = 0; i < 4; ++i) trace.add("/a/tick", i * 10ms, 1ms);
  trace.add("/q/tick", 12ms, 1ms).thread = 2;
  trace.add("/b/tick", 15ms, 1ms).thread = 1;
  std::sort(trace.executions.begin(), trace.executions.end(),
            [](const auto& a, const auto& b) { return a.start < b.start; });
  const MeasuredModel model = model_of(trace);
  EXPECT_EQ(model.lost_executions, 5u + 2u);
  ASSERT_EQ(model.callbacks.size(), 3u);
  EXPECT_EQ(model.callbacks[0].executions, 2u);
  EXPECT_EQ(model.callbacks[0].longest_first_execution, 0ns);  // they may be lost
  EXPECT_EQ(model.callbacks[2].executions, 1u);
}

TEST(Extraction, CountsTheMostThatOneExecutionHasCaused) {
  Made trace;
  for (int i = 0; i < 3; ++i) {
    const std::size_t cause = trace.executions.size();
    trace.add("/a/tick", i * 10ms, 1ms);
    for (int message = 0; message < i; ++message) {
      trace.add("/b//in", i * 10ms + 1ms, 1ms).cause = cause;
    }
  }
  const MeasuredModel model = model_of(trace);
  EXPECT_THAT(model.callbacks[0].causes, ElementsAre(Pair("/b/in", 2)));
  EXPECT_THAT(model.callbacks[1].causes, IsEmpty());
}

// A model did not say that something else sends, too.
TEST(Extraction, KnowsWhatNoCallbackHasCaused) {
  Made trace;
  trace.add("/a/tick", 0ms, 1ms).kind = "timer";
  for (const auto time : {1ms, 4ms, 6ms}) trace.add("/b/in", time, 1ms).kind = "subscription";
  trace.executions[2].cause = 0;
  const MeasuredModel model = model_of(trace);
  EXPECT_EQ(model.callbacks[0].uncaused, 0u);
  EXPECT_EQ(model.callbacks[1].uncaused, 2u);
  EXPECT_THAT(model.callbacks[1].uncaused_distances, ElementsAre(5ms));
  // Nor what one has caused that was let go, and is in no model.
  trace.executions[0].callback = "(removed)";
  EXPECT_EQ(model_of(trace).callbacks.at(0).uncaused, 3u);
}

// CPU time alone hid that a callback sleeps.
TEST(Extraction, MeasuresHowLongACallbackWaits) {
  Made trace;
  trace.add("/a/tick", 0ms, 1ms).end = 5ms;  // preempted
  EXPECT_EQ(model_of(trace).callbacks[0].longest_wait, 0ns);
  trace.executions[0].has_waited = true;
  EXPECT_EQ(model_of(trace).callbacks[0].longest_wait, 4ms);
}

TEST(Extraction, TellsBusyFromIdle) {
  Made trace;
  for (int i = 0; i < 200; ++i) {
    TracedExecution& first = trace.add("/a/tick", i * 10ms, 1ms);
    first.start += 50us;  // an idle thread wakes
    const Nanoseconds end = first.end += 50us;
    TracedExecution& next = trace.add("/b/in", i * 10ms + 1ms, 1ms);
    next.start = end + 2us;
    next.end = next.start + 1ms;
  }
  EXPECT_EQ(model_of(trace).wake_overhead.median, 50us);
  EXPECT_EQ(model_of(trace).wake_overhead.longest, 50us);
  EXPECT_EQ(model_of(trace).dispatch_overhead.least, 2us);
  EXPECT_EQ(model_of(trace).dispatch_overhead.p99, 2us);
  trace.threads[0].is_prompt = false;
  EXPECT_EQ(model_of(trace).wake_overhead.longest, 0ns);
}

// A thread below others waited 100 ms for the CPU; that was no overhead of a wake-up.
TEST(Extraction, IsNotMisledByMoreUrgentThreads) {
  Made trace;
  trace.threads.push_back(trace.threads[0]);
  for (int i = 0; i < 200; ++i) {
    TracedExecution& urgent = trace.add("/a/tick", i * 10ms, 5ms);
    urgent.start += 50us;
    const Nanoseconds end = urgent.end;
    TracedExecution& other = trace.add("/b/tick", i * 10ms, 1ms);
    other.thread = 1;
    other.start = end + 3us;
    other.end = other.start + 1ms;
  }
  EXPECT_EQ(model_of(trace).wake_overhead.longest, 50us);
}

// The longer a wake-up, the likelier ends something on another CPU meanwhile.
TEST(Extraction, ALongWakeUpBesideAnotherCpuCounts) {
  Made trace;
  trace.threads.push_back({.process = "p", .name = "other", .tid = 8, .is_prompt = true});
  for (int i = 0; i < 200; ++i) {
    trace.add("/a/tick", i * 10ms, 1ms);
    TracedExecution& late = trace.add("/b/tick", i * 10ms, 1ms);
    late.thread = 1;
    late.start += 3ms;
    late.end += 3ms;
  }
  EXPECT_EQ(model_of(trace).wake_overhead.longest, 3ms);
}

TEST(Extraction, HasCallbacksThatNeverRan) {
  Made trace;
  trace.about["callbacks"] = {"/a/reset"};
  const MeasuredModel model = model_of(trace);
  ASSERT_EQ(model.callbacks.size(), 1u);
  EXPECT_EQ(model.callbacks[0].executions, 0u);
}

TEST(Extraction, TakesTheWorstOfSeveralTraces) {
  const std::vector<Trace> traces{
      periodic(), [] {
        Made trace(5);
        trace.add("/a/tick", 0ms, 3ms);
        trace.add("/a/tick", 2ms, 3ms);
        trace.about["chains"] = {
            {{"name", "c"},
             {"latency_us", {{"count", 7}, {"p50", 1.5}, {"p99", 2}, {"p999", 3}, {"max", 4}}}}};
        return trace;
      }()};
  const MeasuredModel model = extract_model(traces);
  EXPECT_EQ(model.callbacks[0].executions, 102u);
  EXPECT_EQ(model.callbacks[0].longest_execution, 3ms);
  EXPECT_EQ(model.callbacks[0].least_distances[0], 2ms);
  EXPECT_EQ(model.duration, 5s);
  EXPECT_EQ(model.total_duration, 15s);
  ASSERT_EQ(model.chains.size(), 1u);
  EXPECT_EQ(model.chains[0].instances, 7u);
  EXPECT_EQ(model.chains[0].median, 1500ns);
  EXPECT_EQ(model.chains[0].p99, 2us);
  EXPECT_EQ(model.chains[0].p999, 3us);
  EXPECT_EQ(model.chains[0].longest, 4us);
  const json written = model_json(model).at("chains").at(0).at("latency_us");
  EXPECT_EQ(written, json::parse(R"({"p50": 1.5, "p99": 2.0, "p999": 3.0, "max": 4.0})"));
}

// Each process has its piece of a chain: two pieces of 7 instances are 7 instances.
TEST(Extraction, CountsTheInstancesOfAChainThroughSeveralProcessesOnce) {
  Made trace = periodic();
  for (const int count : {8, 7}) {
    trace.about["chains"].push_back(
        {{"name", "c"},
         {"latency_us", {{"count", count}, {"p50", 1}, {"p99", 2}, {"p999", 3}, {"max", 4}}}});
  }
  EXPECT_EQ(model_of(trace).chains.at(0).instances, 7u);
}

TEST(Model, IsReadAsItWasWritten) {
  Made trace = periodic();
  trace.about["callbacks"] = {"/a/reset"};
  trace.about["chains"] = {
      {{"name", "to act"},
       {"latency_us", {{"count", 7}, {"p50", 1.5}, {"p99", 2}, {"p999", 3}, {"max", 4}}}}};
  trace.add("/b/in", 2s, 2ms).cause = 3;
  trace.executions.back().lost = 4;
  MeasuredModel model = model_of(trace);
  model.lost_executions = 9;
  model.margin = 0.35;
  model.dispatch_overhead = {.longest = 7us};
  model.wake_overhead = {9us, 10us, 11us, 12us, 13us, 41'234ns};
  const std::string path = testing::TempDir() + "model_test.model.yaml";
  write_measured_model(model, path);
  const MeasuredModel read = read_measured_model(path);
  std::filesystem::remove(path);
  EXPECT_EQ(read.chains.at(0).p999, 3us);
  EXPECT_EQ(model_json(read), model_json(model));
  EXPECT_EQ(model_json(read).at("callbacks").size(), 3u);
}

}  // namespace
}  // namespace takt::tools
