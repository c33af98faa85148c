// Tests of the trace ring, and of what executors write into it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/trace_ring.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>

#include "takt/base/error.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

struct Scan {
  int value = 0;
};
TAKT_MESSAGE(Scan, "test/msg/Scan", value);

TEST(TraceRing, KeepsTheNewestAndCountsTheRest) {
  TraceRing ring(3);  // room for four
  for (std::uint64_t i = 1; i <= 6; ++i) ring.record({.sequence = i});
  EXPECT_EQ(ring.overwritten(), 2u);
  std::vector<std::uint64_t> sequences;
  for (const TraceEvent& event : ring.events()) sequences.push_back(event.sequence);
  EXPECT_THAT(sequences, ElementsAre(3, 4, 5, 6));
}

// Before, a ring could only be read when its thread had ended.
TEST(TraceRing, IsReadWhileItsThreadRecords) {
  TraceRing ring(4);
  std::atomic<bool> must_end{false};
  std::thread writer([&] {
    for (std::uint64_t i = 1; !must_end.load(); ++i)
      ring.record({.callback = static_cast<CallbackId>(i),
                   .sequence = i,
                   .lost = i,
                   .cpu_time = Nanoseconds(i)});
  });
  std::size_t read = 0;
  std::uint64_t newest = 0;
  while (read < 1000) {
    std::uint64_t before = 0;
    for (const TraceEvent& event : ring.events()) {
      ++read;
      ASSERT_TRUE(event.lost == event.sequence && event.cpu_time == Nanoseconds(event.sequence));
      ASSERT_TRUE(before == 0 || event.sequence == before + 1);
      before = event.sequence;
    }
    ASSERT_TRUE(before == 0 || before >= newest);
    newest = std::max(newest, before);
  }
  must_end = true;
  writer.join();
}

TEST(TraceRing, BeginsAgainWithWhatComesThen) {
  TraceRing ring;
  EXPECT_FALSE(ring.is_on());
  for (const std::uint64_t first : {1, 11}) {
    ring.begin(4);
    for (std::uint64_t i = first; i < first + 3; ++i) ring.record({.sequence = i});
    ring.end();
    std::vector<std::uint64_t> sequences;
    for (const TraceEvent& event : ring.events()) sequences.push_back(event.sequence);
    EXPECT_THAT(sequences, ElementsAre(first, first + 1, first + 2));
    EXPECT_EQ(ring.overwritten(), 0u);
  }
}

TEST(Trace, BeginsAndEndsWhileAnExecutorLives) {
  for (const std::string& type : executors().names()) {
    ManualClock clock;
    const auto node = std::make_shared<Node>("robot", NodeOptions{.clock = &clock});
    const auto executor = executors().make(type, {.clock = &clock});
    const auto timer = node->create_timer("tick", 10ms, [] {});
    executor->add_node(node);
    const auto run = [&] {
      clock.work(10ms);
      executor->spin_some();
    };
    run();
    executor->begin_trace(16);
    run();
    run();
    executor->end_trace();
    run();
    std::vector<std::string> ready;
    for (const ThreadStatistics& thread : executor->traces()) {
      for (const NamedTraceEvent& event : thread.trace)
        ready.push_back(event.name + " " + std::to_string(event.ready.time_since_epoch() / 1ms));
    }
    EXPECT_THAT(ready, ElementsAre("/robot/tick 20", "/robot/tick 30")) << type;
    const auto traced = executors().make(type, {.trace_events = 16, .clock = &clock});
    EXPECT_THROW(traced->begin_trace(16), Error) << type;
  }
}

TEST(Trace, RecordsWhatRanWhenAndWhatWasLost) {
  ManualClock clock;
  NodeOptions node_options;
  node_options.clock = &clock;
  const auto node = std::make_shared<Node>("robot", node_options);
  const auto executor = executors().make(
      "events", {.statistics = StatisticsLevel::off, .trace_events = 100, .clock = &clock});
  const auto publisher = node->create_publisher<Scan>("scan", 2);
  const auto timer = node->create_timer("tick", 10ms, [&] {
    for (int i = 0; i < 3; ++i) publisher->publish(Scan{i});
    clock.work(4ms);
  });
  const auto subscription =
      node->create_subscription<Scan>("scan", 2, [&](const Scan&) { clock.work(1ms); });
  executor->add_node(node);
  executor->spin_some();
  clock.work(10ms);
  executor->spin_all();
  const auto threads = executor->thread_statistics();
  ASSERT_EQ(threads.size(), 1u);
  std::vector<std::string> trace;
  for (const NamedTraceEvent& event : threads[0].trace) {
    trace.push_back(event.name + " " + std::to_string(event.ready.time_since_epoch() / 1ms) + " " +
                    std::to_string(event.start.time_since_epoch() / 1ms) + " " +
                    std::to_string(event.end.time_since_epoch() / 1ms) + " lost " +
                    std::to_string(event.lost));
    EXPECT_EQ(event.chain_instance, threads[0].trace[0].chain_instance);
    EXPECT_EQ(event.cause, event.name == "/robot/tick" ? 0 : threads[0].trace[0].path);
    EXPECT_GT(event.cpu_time, 0ns);
  }
  EXPECT_THAT(trace, ElementsAre("/robot/tick 10 10 14 lost 0", "/robot/scan 10 14 15 lost 1",
                                 "/robot/scan 10 15 16 lost 0"));
}

}  // namespace
}  // namespace takt
