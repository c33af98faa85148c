// SPDX-License-Identifier: Apache-2.0
#include <future>

#include "takt/messages/rcl_interfaces/msg/log.hpp"
#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using std_msgs::msg::String;
using SimulatedTime = RclcppTest;

// Time goes on while nobody spins, as /clock has a thread of its own.
TEST_F(SimulatedTime, FollowsTheTopicClock) {
  const auto simulator = std::make_shared<Node>("simulator");
  const auto publisher = simulator->create_publisher<rosgraph_msgs::msg::Clock>("/clock", 10);
  const auto node =
      std::make_shared<Node>("node", NodeOptions().append_parameter_override("use_sim_time", true));
  EXPECT_TRUE(node->get_clock()->ros_time_is_active());
  EXPECT_EQ(node->now().nanoseconds(), 0);
  EXPECT_FALSE(simulator->get_clock()->ros_time_is_active());
  auto sleeper = std::async(
      std::launch::async, [&] { return node->get_clock()->sleep_until(Time(5, 0, RCL_ROS_TIME)); });
  int calls = 0;
  const auto timer = node->create_timer(1s, [&] { ++calls; });
  rosgraph_msgs::msg::Clock clock;
  clock.clock.sec = 5;
  const auto end = std::chrono::steady_clock::now() + kLong;
  while (sleeper.wait_for(1ms) != std::future_status::ready) {
    ASSERT_LT(std::chrono::steady_clock::now(), end);
    publisher->publish(clock);
  }
  EXPECT_TRUE(sleeper.get());
  EXPECT_EQ(node->now().seconds(), 5);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  clock.clock.sec = 7;
  publisher->publish(clock);
  EXPECT_TRUE(spin_until(executor, [&] { return calls != 0; }));
  EXPECT_EQ(calls, 1);  // the missed release is left out
}

TEST_F(SimulatedTime, ASleepEndsWithTheContext) {
  const auto node =
      std::make_shared<Node>("node", NodeOptions().append_parameter_override("use_sim_time", true));
  auto sleeper = std::async(std::launch::async, [&] {
    try {
      return node->get_clock()->sleep_for(Duration(1, 0));
    } catch (const std::runtime_error&) {  // it began after the shutdown
      return false;
    }
  });
  shutdown();
  EXPECT_FALSE(sleeper.get());
}

// The callback's timer went with its handle: what the callback then did with it used freed memory.
TEST_F(SimulatedTime, ACallbackMayUseTheTimerWhoseHandleItHasDropped) {
  const auto node = std::make_shared<Node>("node");
  bool has_run = false;
  TimerBase::SharedPtr timer;
  timer = node->create_wall_timer(
      1ms,
      [&](TimerBase& self) {
        timer.reset();
        self.cancel();
        has_run = self.is_canceled() && self.is_steady();
      },
      nullptr, false);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  timer->reset();
  EXPECT_TRUE(spin_until(executor, [&] { return has_run; }));
}

// robot_localization does so.
TEST_F(SimulatedTime, ATimerThatAProgramMakesItselfGetsANodeLater) {
  const auto node = std::make_shared<Node>("node");
  int calls = 0;
  const auto context = node->get_node_base_interface()->get_context();
  const auto timer = WallTimer<VoidCallbackType>::make_shared(
      1ms, [&] { ++calls; }, context);
  EXPECT_THROW(timer->cancel(), std::runtime_error);
  const auto other = GenericTimer<VoidCallbackType>::make_shared(
      node->get_clock(), 1ms, [&] { ++calls; }, context);
  for (const TimerBase::SharedPtr& made :
       {TimerBase::SharedPtr(timer), TimerBase::SharedPtr(other)}) {
    node->get_node_timers_interface()->add_timer(made, nullptr);
    EXPECT_THROW(node->get_node_timers_interface()->add_timer(made, nullptr), std::runtime_error);
    executors::SingleThreadedExecutor executor;
    executor.add_node(node);
    EXPECT_TRUE(spin_until(executor, [&] { return calls > 1; }));
    executor.remove_node(node);
    made->cancel();
    calls = 0;
  }
}

// Clocks of a program's own have the time of a node, and tell when it jumps.
TEST_F(SimulatedTime, ATimeSourceSetsOtherClocks) {
  const auto clock = std::make_shared<Clock>(RCL_ROS_TIME);
  EXPECT_FALSE(clock->ros_time_is_active());
  const auto node =
      std::make_shared<Node>("node", NodeOptions().append_parameter_override("use_sim_time", true));
  auto source = std::make_unique<TimeSource>(node);
  EXPECT_THROW(source->attachClock(std::make_shared<Clock>()), std::invalid_argument);
  source->attachClock(clock);
  source->attachClock(node->get_clock());  // which has that time already
  EXPECT_TRUE(clock->ros_time_is_active());
  EXPECT_EQ(clock->now().nanoseconds(), 0);
  std::atomic<std::int64_t> back{0};
  const auto handler = clock->create_jump_callback(
      nullptr, [&](const rcl_time_jump_t& jump) { back += jump.delta.nanoseconds; },
      {false, {0}, {-1}});
  const auto publisher = node->create_publisher<rosgraph_msgs::msg::Clock>("/clock", 10);
  for (const std::int32_t seconds : {5, 2}) {
    rosgraph_msgs::msg::Clock message;
    message.clock.sec = seconds;
    EXPECT_TRUE(takt::eventually([&] {
      publisher->publish(message);
      return clock->now().seconds() == seconds;
    }));
  }
  EXPECT_TRUE(takt::eventually([&] { return back == -3'000'000'000; }));
  source->detachNode();
  EXPECT_FALSE(clock->ros_time_is_active());
  source.reset();  // it set the node's own clock back, which it had left before
  EXPECT_TRUE(node->get_clock()->ros_time_is_active());
}

// The handler of tf2 goes whenever its buffer does, also in its own callback.
TEST_F(SimulatedTime, AJumpHandlerMayGoInItsCallback) {
  const auto clock = std::make_shared<takt::SimulatedClock>(takt::Clock::steady(), false);
  std::atomic<bool> is_set{false}, has_gone{false};
  JumpHandler::SharedPtr handler;
  handler = std::make_shared<JumpHandler>(
      clock, [&] { is_set.wait(false); },
      [&](const rcl_time_jump_t& jump) {
        EXPECT_EQ(jump.clock_change, RCL_ROS_TIME_ACTIVATED);
        handler.reset();
        has_gone = true;
      },
      rcl_jump_threshold_t{true, {0}, {0}});
  clock->simulate(true);
  is_set = true;
  is_set.notify_all();
  EXPECT_TRUE(takt::eventually([&] { return has_gone.load(); }));
}

// Each waited for the thread of the other, in whose callback it was.
TEST_F(SimulatedTime, TwoJumpHandlersMayDropEachOther) {
  const auto clock = std::make_shared<takt::SimulatedClock>(takt::Clock::steady(), false);
  std::atomic<int> inside{0}, dropped{0};
  JumpHandler::SharedPtr first, second;
  const auto drop = [&](JumpHandler::SharedPtr& other) {
    return [&inside, &dropped, &other](const rcl_time_jump_t& jump) {
      EXPECT_EQ(jump.delta.nanoseconds, 0);  // the times before and after are of two sources
      ++inside;
      EXPECT_TRUE(takt::eventually([&] { return inside == 2; }));
      other.reset();
      ++dropped;
    };
  };
  const rcl_jump_threshold_t threshold{true, {0}, {0}};
  first = std::make_shared<JumpHandler>(clock, nullptr, drop(second), threshold);
  second = std::make_shared<JumpHandler>(clock, nullptr, drop(first), threshold);
  clock->simulate(true);
  EXPECT_TRUE(takt::eventually([&] { return dropped == 2; }));
}

// The clocks set each other, each under its lock.
TEST_F(SimulatedTime, TwoTimeSourcesMayHaveEachOthersClocks) {
  const auto options = NodeOptions().append_parameter_override("use_sim_time", true);
  const auto a = std::make_shared<Node>("a", options), b = std::make_shared<Node>("b", options);
  auto of_a = std::make_unique<TimeSource>(a);
  TimeSource of_b(b);
  of_a->attachClock(b->get_clock());
  of_b.attachClock(a->get_clock());
  const auto publisher = a->create_publisher<rosgraph_msgs::msg::Clock>("/clock", 10);
  const auto have = [&](std::int32_t seconds) {
    rosgraph_msgs::msg::Clock message;
    message.clock.sec = seconds;
    return takt::eventually([&] {
      publisher->publish(message);
      return a->now().seconds() == seconds && b->now().seconds() == seconds;
    });
  };
  EXPECT_TRUE(have(5));
  a->set_parameter(Parameter("use_sim_time", false));
  EXPECT_FALSE(b->get_clock()->ros_time_is_active());
  a->set_parameter(Parameter("use_sim_time", true));
  EXPECT_TRUE(have(7));
}

// The end of a sleep in real time was awaited in simulated time, for years.
TEST_F(SimulatedTime, ASleepEndsWhenTheClockHasAnotherSource) {
  const auto node = std::make_shared<Node>("node");
  const auto clock = node->get_clock();
  for (const bool simulates : {true, false}) {
    auto sleeper = std::async(std::launch::async, [&] { return clock->sleep_for(kLong); });
    auto rate =
        std::async(std::launch::async, [&] { return Rate(Duration(kLong), clock).sleep(); });
    EXPECT_EQ(sleeper.wait_for(10ms), std::future_status::timeout);
    EXPECT_EQ(rate.wait_for(10ms), std::future_status::timeout);
    node->set_parameter(Parameter("use_sim_time", simulates));
    EXPECT_FALSE(sleeper.get());
    EXPECT_TRUE(rate.get());
  }
}

// It was known to executors first and cancelled afterwards, so it could fire in between.
TEST_F(SimulatedTime, ATimerWithoutAutostartIsCancelledBeforeAnExecutorHasIt) {
  const auto node = std::make_shared<Node>("node");
  struct Listener final : takt::NodeListener {
    void entity_added(takt::Node&, const std::shared_ptr<takt::Entity>& entity) override {
      if (auto* timer = dynamic_cast<takt::Timer*>(entity.get())) {
        ++timers;
        EXPECT_TRUE(timer->is_canceled());
      }
    }
    void group_added(takt::Node&, const std::shared_ptr<takt::CallbackGroup>&) override {}
    void parameters_changed(takt::Node&) override {}
    int timers = 0;
  } listener;
  const auto core = node->get_node_base_interface()->takt_node();
  core->add_listener(listener);
  const auto wall = node->create_wall_timer(
      1ns, [] {}, nullptr, false);
  const auto timer = create_timer(
      node, node->get_clock(), Duration(1ns), [] {}, nullptr, false);
  EXPECT_EQ(listener.timers, 2);
  EXPECT_TRUE(wall->is_canceled() && timer->is_canceled());
  EXPECT_FALSE(node->create_wall_timer(1h, [] {})->is_canceled());
  core->remove_listener(listener);
}

using Departures = RclcppTest;

// Programs drop nodes, and parts of them, in callbacks and while another thread spins.
TEST_F(Departures, ANodeMayGoWhileItIsSpun) {
  executors::MultiThreadedExecutor executor(ExecutorOptions(), 2);
  const Spinner spinner(executor);
  for (int i = 0; i < 20; ++i) {
    auto node = std::make_shared<Node>("node", NodeOptions().start_parameter_services(false));
    std::promise<void> called;
    std::once_flag once;
    auto timer =
        node->create_wall_timer(1ms, [&] { std::call_once(once, [&] { called.set_value(); }); });
    executor.add_node(node);
    ASSERT_EQ(called.get_future().wait_for(kLong), std::future_status::ready);
    timer.reset();
    node.reset();
  }
}

TEST_F(Departures, ParametersOverrideTheQoSOfATopic) {
  const auto node = std::make_shared<Node>(
      "node",
      NodeOptions()
          .append_parameter_override("qos_overrides./topic.publisher.depth", 3)
          .append_parameter_override("qos_overrides./topic.publisher.reliability", "best_effort"));
  PublisherOptions options;
  options.qos_overriding_options = QosOverridingOptions::with_default_policies();
  const auto publisher = node->create_publisher<String>("topic", 10, options);
  EXPECT_EQ(publisher->get_actual_qos().depth(), 3u);
  EXPECT_EQ(publisher->get_actual_qos().reliability(), ReliabilityPolicy::BestEffort);
  const auto second = node->create_publisher<String>("topic", 10, options);  // of the same topic
  EXPECT_EQ(second->get_actual_qos().depth(), 3u);
  EXPECT_EQ(node->get_parameter("qos_overrides./topic.publisher.history").as_string(), "keep_last");
}

// Did not compile: an interface for topics has no parameters, and so cannot be asked for them.
TEST_F(Departures, AnInterfaceForTopicsIsEnoughUntilParametersAreToOverride) {
  const auto node = std::make_shared<Node>("node");
  const auto topics = node->get_node_topics_interface();
  const auto subscription = create_subscription<String>(node->get_node_parameters_interface(),
                                                        topics, "topic", 10, [](const String&) {});
  EXPECT_STREQ(create_publisher<String>(topics, "topic", 10)->get_topic_name(), "/topic");
  PublisherOptions options;
  options.qos_overriding_options = QosOverridingOptions::with_default_policies();
  EXPECT_THROW(create_publisher<String>(topics, "topic", 10, options), std::runtime_error);
}

TEST_F(Departures, LinesOfALoggerGoToRosout) {
  const auto node = std::make_shared<Node>("node", "/space");
  std::vector<std::string> lines;
  const auto subscription = node->create_subscription<rcl_interfaces::msg::Log>(
      "/rosout", RosoutQoS(),
      [&](const rcl_interfaces::msg::Log& line) { lines.push_back(line.name + ": " + line.msg); });
  RCLCPP_INFO(node->get_logger().get_child("part"), "%d lines", 1);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  EXPECT_TRUE(spin_until(executor, [&] { return !lines.empty(); }));
  EXPECT_EQ(lines, std::vector<std::string>{"space.node.part: 1 lines"});
}

}  // namespace
}  // namespace rclcpp
