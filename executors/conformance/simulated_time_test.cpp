// Timers and coroutines of nodes whose time is simulated. Run for every executor under every
// scheduler. The numbers in the comments are those of the rclcpp issues whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/ros2/time_source.hpp"

namespace takt::conformance {
namespace {

class ConformanceSimulatedTime : public Conformance {
 protected:
  void set(Nanoseconds time) {
    simulated_.set(TimePoint(time));
    executor_->spin_all();
  }
  ManualClock clock_;
  SimulatedClock simulated_{clock_};
  const std::unique_ptr<Executor> executor_ = make(clock_);
  const std::shared_ptr<Node> node_ = make_node(simulated_);
  std::vector<std::string> trace_;
};

// #2535: timers of another clock than the executor's.
TEST_P(ConformanceSimulatedTime, TimersFollowTheClockThroughJumps) {
  simulated_.set(TimePoint(100s));
  int calls = 0;
  const auto timer = node_->create_timer("tick", 10ms, [&] { ++calls; });
  executor_->add_node(node_);
  clock_.advance(1h);  // real time is nothing to it
  set(100s + 9ms);
  EXPECT_EQ(calls, 0);
  set(100s + 10ms);
  EXPECT_EQ(calls, 1);
  set(100s + 55ms);  // forward: one release, and those between are missed
  EXPECT_EQ(calls, 2);
  EXPECT_EQ(timer->missed(), 3u);
  set(50s);  // back: what was due in 5 ms still is
  EXPECT_EQ(calls, 2);
  set(50s + 4ms);
  EXPECT_EQ(calls, 2);
  set(50s + 5ms);
  EXPECT_EQ(calls, 3);
  timer->cancel();
  set(60s);
  EXPECT_EQ(calls, 3);
}

TEST_P(ConformanceSimulatedTime, CoroutinesSleepUntilTheClockIsThere) {
  const auto timer = node_->create_timer("sleeper", 10ms, [&]() -> Task<> {
    trace_.push_back("sleeps");
    co_await sleep_for(20ms);
    trace_.push_back("awake");
  });
  executor_->add_node(node_);
  set(10ms);
  set(29ms);
  set(5ms);
  set(29ms);
  EXPECT_THAT(trace_, ElementsAre("sleeps"));
  set(30ms);
  EXPECT_THAT(trace_.back(), "awake");
}

TEST_P(ConformanceSimulatedTime, ATimeSourceFollowsTheTopicClock) {
  const auto host = make_node(clock_, "host");
  const TimeSource source(*host, simulated_);
  const auto simulator = host->create_publisher<rosgraph_msgs::msg::Clock>("/clock", 1);
  int calls = 0;
  const auto timer = node_->create_timer("tick", 10ms, [&] { ++calls; });
  executor_->add_node(node_);
  executor_->add_node(host);
  for (int i = 1; i <= 3; ++i) {
    simulator->publish(rosgraph_msgs::msg::Clock().set__clock(
        builtin_interfaces::msg::Time().set__nanosec(static_cast<std::uint32_t>(i * 5'000'000))));
    executor_->spin_all();
  }
  EXPECT_EQ(simulated_.now(), TimePoint(15ms));
  EXPECT_EQ(calls, 1);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceSimulatedTime);

}  // namespace
}  // namespace takt::conformance
