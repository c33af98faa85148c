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
  ManualClock clock_{TimePoint{}, virtual_cpus()};
  SimulatedClock simulated_{clock_};
  const std::unique_ptr<Executor> executor_ = make(clock_);
  const std::shared_ptr<Node> node_ = make_node(simulated_);
  std::vector<std::string> trace_;
  Timer* timer_ = nullptr;
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
  EXPECT_THAT(trace_, ElementsAre("sleeps"));
  set(30ms);
  EXPECT_THAT(trace_, ElementsAre("sleeps", "awake"));
}

// The alarm moved back with the clock, but not what it was set for: a coroutine slept until the
// clock was where it had been, perhaps for hours.
TEST_P(ConformanceSimulatedTime, WhenTheClockJumpsBackCoroutinesSleepNoLonger) {
  const auto timer = node_->create_timer("sleeper", 10ms, [&]() -> Task<> {
    timer_->cancel();
    co_await sleep_for(20ms);
    trace_.push_back("has slept");
    co_await sleep_until(simulated_.now() + 20ms);
    trace_.push_back("is awake");
  });
  timer_ = timer.get();
  executor_->add_node(node_);
  set(1h);
  set(1h + 15ms);
  set(10ms);  // 5 ms are left
  set(14ms);
  EXPECT_THAT(trace_, ElementsAre());
  set(15ms);
  EXPECT_THAT(trace_, ElementsAre("has slept"));
  set(30ms);
  set(1ms);  // 5 ms are left
  set(5ms);
  EXPECT_THAT(trace_, ElementsAre("has slept"));
  set(6ms);
  EXPECT_THAT(trace_, ElementsAre("has slept", "is awake"));
}

/// Nodes whose time becomes simulated and real again. The clock itself is set by the test.
class ConformanceSwitchedTime : public ConformanceSimulatedTime {
 protected:
  struct Remembering final : SimulatedClock::Source {
    void follow(const std::shared_ptr<SimulatedClock>& clock) override { followed = clock; }
    void leave(const SimulatedClock&) noexcept override { followed.reset(); }
    std::shared_ptr<SimulatedClock> followed;
  };
  std::shared_ptr<Node> make_follower(const char* name,
                                      std::shared_ptr<SimulatedClock::Source> source) {
    NodeOptions options;
    options.clock = &clock_;
    options.time_source = std::move(source);
    return std::make_shared<Node>(name, options);
  }
  static void use_sim_time(Node& node, bool value) {
    EXPECT_EQ(node.set_parameters_atomically({{kUseSimTime, value}}).reason, "");
  }
  void advance(Nanoseconds by) {
    clock_.advance(by);
    executor_->spin_all();
  }
  void simulate(Nanoseconds time) {
    source_->followed->set(TimePoint(time));
    executor_->spin_all();
  }
  const std::shared_ptr<Remembering> source_ = std::make_shared<Remembering>();
  const std::shared_ptr<Node> follower_ = make_follower("follower", source_);
};

TEST_P(ConformanceSwitchedTime, TimersKeepWhatIsLeftOfTheirPeriods) {
  int calls = 0;
  const auto timer = follower_->create_timer("tick", 10ms, [&] { ++calls; });
  executor_->add_node(follower_);
  advance(10ms);
  EXPECT_EQ(calls, 1);
  advance(4ms);
  use_sim_time(*follower_, true);  // 6 ms are left
  advance(1h);
  EXPECT_EQ(follower_->clock().now(), TimePoint{});
  simulate(1'000'000s);  // the first time is no jump
  simulate(1'000'000s + 5ms);
  EXPECT_EQ(calls, 1);
  simulate(1'000'000s + 6ms);
  EXPECT_EQ(calls, 2);
  simulate(1'000'000s + 9ms);
  use_sim_time(*follower_, false);  // 7 ms are left
  advance(7ms - 1ns);
  EXPECT_EQ(calls, 2);
  advance(1ns);
  EXPECT_EQ(calls, 3);
  advance(25ms);
  EXPECT_EQ(calls, 4);
  EXPECT_EQ(timer->missed(), 1u);
  EXPECT_EQ(follower_->clock().now(), clock_.now());
}

TEST_P(ConformanceSwitchedTime, CoroutinesSleepForAsLongAsTheyHaveSaid) {
  const auto timer = follower_->create_timer("sleeper", 10ms, [&]() -> Task<> {
    timer_->cancel();
    co_await sleep_for(20ms);
    trace_.push_back("has slept");
    co_await sleep_until(follower_->clock().now() + 20ms);
    trace_.push_back("is awake");
  });
  timer_ = timer.get();
  executor_->add_node(follower_);
  advance(10ms);
  advance(15ms);
  use_sim_time(*follower_, true);  // 5 ms are left
  simulate(1h);
  advance(1h);
  simulate(1h + 4ms);
  EXPECT_THAT(trace_, ElementsAre());
  simulate(1h + 5ms);
  EXPECT_THAT(trace_, ElementsAre("has slept"));
  simulate(1h + 15ms);
  use_sim_time(*follower_, false);  // 10 ms are left
  advance(9ms);
  EXPECT_THAT(trace_, ElementsAre("has slept"));
  advance(1ms);
  EXPECT_THAT(trace_, ElementsAre("has slept", "is awake"));
}

TEST_P(ConformanceSwitchedTime, ATimeSourceFollowsTheTopicClock) {
  const auto source = std::make_shared<TimeSource>();
  const auto host = make_node(clock_, "host");
  source->set_host(host);
  const auto follower = make_follower("other", source);
  use_sim_time(*follower, true);  // before the first spin: an executor may be frozen then
  const auto simulator = host->create_publisher<rosgraph_msgs::msg::Clock>("/clock", 1);
  int calls = 0;
  const auto timer = follower->create_timer("tick", 10ms, [&] { ++calls; });
  executor_->add_node(follower);
  executor_->add_node(host);
  for (const int milliseconds : {5, 10, 14, 15}) {
    EXPECT_EQ(calls, 0);
    simulator->publish(
        rosgraph_msgs::msg::Clock().set__clock(builtin_interfaces::msg::Time().set__nanosec(
            static_cast<std::uint32_t>(milliseconds) * 1'000'000)));
    executor_->spin_all();
    EXPECT_EQ(follower->clock().now(), TimePoint(milliseconds * 1ms));
  }
  EXPECT_EQ(calls, 1);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceSimulatedTime);
TAKT_INSTANTIATE_CONFORMANCE(ConformanceSwitchedTime);

}  // namespace
}  // namespace takt::conformance
