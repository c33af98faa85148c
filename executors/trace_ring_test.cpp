// Tests of the trace ring, and of what executors write into it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/trace_ring.hpp"

#include <gmock/gmock.h>

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
