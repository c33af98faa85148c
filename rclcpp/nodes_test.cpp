// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <unistd.h>

#include "takt/messages/entries.hpp"
#include "takt/messages/example_interfaces/action/fibonacci.hpp"
#include "takt/messages/lifecycle_msgs/msg/transition.hpp"
#include "takt/messages/rcl_interfaces/srv/get_logger_levels.hpp"
#include "takt/messages/rcl_interfaces/srv/set_logger_levels.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

#include "rclcpp_action/rclcpp_action.hpp"
#include "rclcpp_lifecycle/lifecycle_node.hpp"
#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using example_interfaces::action::Fibonacci;
using std_msgs::msg::String;
using Nodes = RclcppTest;

// An override must call the base class, or its publishers stay inactive.
class Talker : public rclcpp_lifecycle::LifecycleNode {
 public:
  explicit Talker(bool calls_base) : LifecycleNode("talker"), calls_base_(calls_base) {}
  CallbackReturn on_configure(const rclcpp_lifecycle::State& previous) override {
    EXPECT_EQ(previous.label(), "unconfigured");
    publisher = create_publisher<String>("topic", 10);
    return CallbackReturn::SUCCESS;
  }
  CallbackReturn on_activate(const rclcpp_lifecycle::State& previous) override {
    return calls_base_ ? LifecycleNode::on_activate(previous) : CallbackReturn::SUCCESS;
  }
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State&) override {
    throw std::runtime_error("a failure");
  }
  rclcpp_lifecycle::LifecyclePublisher<String>::SharedPtr publisher;

 private:
  const bool calls_base_;
};

using Handle = rclcpp_action::ServerGoalHandle<Fibonacci>;

/// It accepts every goal, and lets each be cancelled.
template <class Accepted, class... Rest>
rclcpp_action::Server<Fibonacci>::SharedPtr willing_server(const Node::SharedPtr& node,
                                                           Accepted accepted, Rest... rest) {
  return rclcpp_action::create_server<Fibonacci>(
      node, "fibonacci",
      [](const auto&, const auto&) { return rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE; },
      [](const std::shared_ptr<Handle>) { return rclcpp_action::CancelResponse::ACCEPT; },
      std::move(accepted), std::move(rest)...);
}

TEST_F(Nodes, LifecyclePublishersFollowTheBaseClass) {
  const auto talker = std::make_shared<Talker>(true);
  EXPECT_EQ(talker->configure().label(), "inactive");
  EXPECT_FALSE(talker->publisher->is_activated());
  EXPECT_EQ(talker->trigger_transition(lifecycle_msgs::msg::Transition::TRANSITION_ACTIVATE).id(),
            3);
  EXPECT_TRUE(talker->publisher->is_activated());
  EXPECT_EQ(talker->deactivate().label(), "inactive");
  EXPECT_FALSE(talker->publisher->is_activated());
  const auto other = std::make_shared<Talker>(false);
  other->configure();
  other->activate();
  EXPECT_FALSE(other->publisher->is_activated());
  int received = 0;
  const auto subscription =
      other->create_subscription<String>("topic", 10, [&](const String&) { ++received; });
  other->publisher->publish(String());  // dropped
  const rclcpp::Publisher<String>::SharedPtr base = other->publisher;
  base->publish(String());  // as controllers of ros2_control do, whose nodes call no base class
  spin_some(other->get_node_base_interface());
  EXPECT_EQ(received, 1);
  Talker::CallbackReturn returned{};
  EXPECT_EQ(other->configure(returned).label(), "active");  // which is no transition from here
  EXPECT_EQ(returned, Talker::CallbackReturn::FAILURE);
}

TEST_F(Nodes, AGoalIsExecutedByAThreadOfItsOwn) {
  const auto node = std::make_shared<Node>("node");
  std::jthread worker;
  const auto server = rclcpp_action::create_server<Fibonacci>(
      node, "fibonacci",
      [](const rclcpp_action::GoalUUID&, std::shared_ptr<const Fibonacci::Goal> goal) {
        return goal->order > 0 ? rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE
                               : rclcpp_action::GoalResponse::REJECT;
      },
      [](const std::shared_ptr<Handle>) { return rclcpp_action::CancelResponse::ACCEPT; },
      [&](const std::shared_ptr<Handle> goal) {
        worker = std::jthread([goal] {
          auto feedback = std::make_shared<Fibonacci::Feedback>();
          feedback->sequence = {1};
          goal->publish_feedback(feedback);
          auto result = std::make_shared<Fibonacci::Result>();
          result->sequence = {goal->get_goal()->order};
          goal->succeed(result);
        });
      });
  const auto client = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  ASSERT_TRUE(client->wait_for_action_server(kLong));
  auto options = rclcpp_action::Client<Fibonacci>::SendGoalOptions();
  int feedbacks = 0;
  options.feedback_callback = [&](auto, const auto& feedback) {
    feedbacks += feedback->sequence[0];
  };
  Fibonacci::Goal goal;
  auto rejected = client->async_send_goal(goal, options);
  ASSERT_EQ(spin_until_future_complete(node, rejected, kLong), FutureReturnCode::SUCCESS);
  EXPECT_EQ(rejected.get(), nullptr);
  goal.order = 7;
  auto accepted = client->async_send_goal(goal, options);
  ASSERT_EQ(spin_until_future_complete(node, accepted, kLong), FutureReturnCode::SUCCESS);
  auto ended = client->async_get_result(accepted.get());
  ASSERT_EQ(spin_until_future_complete(node, ended, kLong), FutureReturnCode::SUCCESS);
  EXPECT_EQ(ended.get().code, rclcpp_action::ResultCode::SUCCEEDED);
  EXPECT_EQ(ended.get().result->sequence, std::vector<std::int32_t>{7});
  EXPECT_EQ(feedbacks, 1);
  EXPECT_THROW(client->async_get_result(nullptr),
               rclcpp_action::exceptions::UnknownGoalHandleError);
}

TEST_F(Nodes, GoalsBeforeATimeAreCancelled) {
  const auto node = std::make_shared<Node>("node");
  std::vector<std::shared_ptr<Handle>> held;
  const auto server = willing_server(node, [&](auto goal) { held.push_back(std::move(goal)); });
  const auto client = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  Time between;
  for (const std::size_t goals : {1, 2}) {
    auto accepted = client->async_send_goal(Fibonacci::Goal());
    ASSERT_TRUE(spin_until(executor, [&] { return held.size() == goals; }));
    if (goals == 1) between = node->now();
  }
  auto cancelled = client->async_cancel_goals_before(between);
  ASSERT_EQ(executor.spin_until_future_complete(cancelled, kLong), FutureReturnCode::SUCCESS);
  EXPECT_EQ(cancelled.get()->goals_canceling.size(), 1u);
  EXPECT_TRUE(held[0]->is_canceling() && !held[1]->is_canceling());
}

// The future of a result waited for ever when the client went and its handle was kept, and a second
// callback for the result was refused.
TEST_F(Nodes, WhoeverAsksForAResultLearnsOfItsEnd) {
  const auto node = std::make_shared<Node>("node");
  std::shared_ptr<Handle> held;
  const auto server = willing_server(node, [&](auto goal) { held = std::move(goal); });
  auto client = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  auto options = rclcpp_action::Client<Fibonacci>::SendGoalOptions();
  int calls = 0;
  options.result_callback = [&](const auto&) { ++calls; };
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  auto accepted = client->async_send_goal(Fibonacci::Goal(), options);
  ASSERT_EQ(executor.spin_until_future_complete(accepted, kLong), FutureReturnCode::SUCCESS);
  auto ended = client->async_get_result(accepted.get(), [&](const auto&) { calls += 10; });
  ASSERT_TRUE(spin_until(executor, [&] { return held != nullptr; }));
  held->succeed(std::make_shared<Fibonacci::Result>());
  ASSERT_EQ(executor.spin_until_future_complete(ended, kLong), FutureReturnCode::SUCCESS);
  EXPECT_EQ(calls, 10);

  accepted = client->async_send_goal(Fibonacci::Goal(), options);
  ASSERT_EQ(executor.spin_until_future_complete(accepted, kLong), FutureReturnCode::SUCCESS);
  ended = client->async_get_result(accepted.get());
  client.reset();
  ASSERT_EQ(ended.wait_for(0s), std::future_status::ready);
  EXPECT_THROW(ended.get(), rclcpp_action::exceptions::UnawareGoalHandleError);
  EXPECT_EQ(calls, 10);
}

// In a pool the callback of the result could run before that of the response had returned.
TEST_F(Nodes, TheResultOfAGoalComesAfterItsResponse) {
  using Goal = rclcpp_action::ClientGoalHandle<Fibonacci>;
  const auto node = std::make_shared<Node>("node");
  const auto group = node->create_callback_group(CallbackGroupType::Reentrant);
  const auto server = willing_server(
      node,
      [&](const std::shared_ptr<Handle> goal) {
        goal->succeed(std::make_shared<Fibonacci::Result>());
      },
      rcl_action_server_get_default_options(), group);
  const auto client = rclcpp_action::create_client<Fibonacci>(node, "fibonacci", group);
  executors::MultiThreadedExecutor executor(ExecutorOptions(), 3);
  executor.add_node(node);
  const Spinner spinner(executor);
  for (const bool asks_early : {true, false}) {
    std::atomic<bool> has_answered{false};
    std::promise<void> told;
    auto options = rclcpp_action::Client<Fibonacci>::SendGoalOptions();
    options.goal_response_callback = [&](const Goal::SharedPtr& goal) {
      if (asks_early) {  // the future is ready, and only the callback waits
        auto result = client->async_get_result(goal);
        EXPECT_EQ(result.wait_for(kLong), std::future_status::ready);
      }
      has_answered = true;
    };
    options.result_callback = [&](const auto&) {
      EXPECT_TRUE(has_answered);
      told.set_value();
    };
    client->async_send_goal(Fibonacci::Goal(), options);
    ASSERT_EQ(told.get_future().wait_for(kLong), std::future_status::ready);
  }
}

// The goal of another client was asked about at the wrong server, whose answer changed it.
TEST_F(Nodes, AGoalIsOfTheClientThatHasSentIt) {
  const auto node = std::make_shared<Node>("node");
  std::shared_ptr<Handle> held;
  const auto server = willing_server(node, [&](auto goal) { held = std::move(goal); });
  auto client = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  auto other = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  auto accepted = client->async_send_goal(Fibonacci::Goal());
  ASSERT_EQ(executor.spin_until_future_complete(accepted, kLong), FutureReturnCode::SUCCESS);
  const auto goal = accepted.get();
  for (const bool is_gone : {false, true}) {
    EXPECT_THROW(other->async_get_result(goal), rclcpp_action::exceptions::UnknownGoalHandleError);
    EXPECT_THROW(other->async_cancel_goal(goal), rclcpp_action::exceptions::UnknownGoalHandleError);
    if (is_gone) break;
    client.reset();
    other = rclcpp_action::create_client<Fibonacci>(node, "fibonacci");
  }
}

TEST_F(Nodes, ParametersOfAnotherNodeAreReadAndSet) {
  const auto server = std::make_shared<Node>("server");
  server->declare_parameter("gain", 0.5);
  executors::SingleThreadedExecutor executor;
  executor.add_node(server);
  const Spinner spinner(executor);
  const auto node = std::make_shared<Node>("node");
  SyncParametersClient client(node, "server");
  ASSERT_TRUE(client.wait_for_service(kLong));
  std::vector<double> heard;
  ParameterEventHandler events(node);
  const auto handle = events.add_parameter_callback(
      "gain", [&](const Parameter& parameter) { heard.push_back(parameter.as_double()); },
      "server");
  EXPECT_EQ(client.get_parameter<double>("gain"), 0.5);
  EXPECT_EQ(client.get_parameter("none", 3), 3);
  EXPECT_TRUE(client.has_parameter("gain"));
  EXPECT_FALSE(client.set_parameters({Parameter("gain", "high")})[0].successful);
  EXPECT_TRUE(client.set_parameters({Parameter("gain", 0.75)})[0].successful);
  EXPECT_EQ(server->get_parameter("gain").as_double(), 0.75);
  executors::SingleThreadedExecutor own;
  own.add_node(node);
  EXPECT_TRUE(spin_until(own, [&] { return !heard.empty(); }));
  EXPECT_EQ(heard, std::vector<double>{0.75});
}

// ROS 2 lists what is called and what is served; it was only the latter.
TEST_F(Nodes, AServiceWithClientsOnlyIsListed) {
  const auto node = std::make_shared<Node>("caller");
  const auto client = node->create_client<rcl_interfaces::srv::GetLoggerLevels>(
      "asked_by_" + std::to_string(getpid()));
  const std::string name = client->get_service_name();
  const std::vector<std::string> type = {"rcl_interfaces/srv/GetLoggerLevels"};
  ASSERT_TRUE(
      takt::eventually([&] { return node->get_service_names_and_types().count(name) == 1; }));
  EXPECT_EQ(node->get_service_names_and_types()[name], type);
  const auto graph = node->get_node_graph_interface();
  EXPECT_EQ(graph->get_client_names_and_types_by_node("caller", "/")[name], type);
  EXPECT_EQ(graph->get_service_names_and_types_by_node("caller", "/").count(name), 0);
}

TEST_F(Nodes, LevelsOfLoggersAreReadAndSetByServices) {
  const auto node = std::make_shared<Node>("levels", NodeOptions().enable_logger_service(true));
  const auto set =
      node->create_client<rcl_interfaces::srv::SetLoggerLevels>("/levels/set_logger_levels");
  const auto get =
      node->create_client<rcl_interfaces::srv::GetLoggerLevels>("/levels/get_logger_levels");
  ASSERT_TRUE(set->wait_for_service(kLong) && get->wait_for_service(kLong));
  auto wanted = std::make_shared<rcl_interfaces::srv::SetLoggerLevels::Request>();
  wanted->levels.resize(2);
  wanted->levels[0].set__name("levels").set__level(10);
  wanted->levels[1].set__name("of nobody").set__level(10);
  auto results = set->async_send_request(wanted);
  ASSERT_EQ(spin_until_future_complete(node, results, kLong), FutureReturnCode::SUCCESS);
  const auto response = results.get();
  EXPECT_TRUE(response->results[0].successful);
  EXPECT_FALSE(response->results[1].successful);
  EXPECT_EQ(node->get_logger().get_effective_level(), Logger::Level::Debug);
  auto asked = std::make_shared<rcl_interfaces::srv::GetLoggerLevels::Request>();
  asked->names = {"levels", "of nobody"};
  auto levels = get->async_send_request(asked);
  ASSERT_EQ(spin_until_future_complete(node, levels, kLong), FutureReturnCode::SUCCESS);
  const auto answer = levels.get();
  EXPECT_EQ(answer->levels[0].level, 10u);
  EXPECT_EQ(answer->levels[1].level, 0u);
  node->get_logger().set_level(Logger::Level::Unset);
  // Strangers send any number.
  for (const std::size_t count : {takt::kMostEntries, takt::kMostEntries + 1}) {
    wanted->levels.resize(count);
    auto many = set->async_send_request(wanted);
    ASSERT_EQ(spin_until_future_complete(node, many, kLong), FutureReturnCode::SUCCESS);
    EXPECT_EQ(many.get()->results.size(), count == takt::kMostEntries ? count : 1);
    asked->names.resize(count);
    auto read = get->async_send_request(asked);
    ASSERT_EQ(spin_until_future_complete(node, read, kLong), FutureReturnCode::SUCCESS);
    EXPECT_EQ(read.get()->levels.size(), count == takt::kMostEntries ? count : 0);
  }
}

TEST_F(Nodes, ParameterEventsOfMoreEntriesThanTheLimitAreNotLookedThrough) {
  const auto node = std::make_shared<Node>("events");
  ParameterEventHandler events(node);
  std::vector<std::size_t> heard;
  const auto handle = events.add_parameter_event_callback(
      [&](const auto& event) { heard.push_back(event.new_parameters.size()); });
  const auto stranger = node->create_publisher<rcl_interfaces::msg::ParameterEvent>(
      "/parameter_events", ParameterEventsQoS());
  for (const std::size_t count : {takt::kMostEntries + 1, takt::kMostEntries}) {
    rcl_interfaces::msg::ParameterEvent event;
    event.new_parameters.resize(count);
    stranger->publish(event);
  }
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  EXPECT_TRUE(spin_until(executor, [&] {
    return std::find(heard.begin(), heard.end(), takt::kMostEntries) != heard.end();
  }));
  EXPECT_EQ(std::count(heard.begin(), heard.end(), takt::kMostEntries + 1), 0);
}

// What a typical node of 90 lines does, in the habits of rclcpp.
class Camera : public Node {
 public:
  explicit Camera(const NodeOptions& options) : Node("camera", options) {
    declare_parameter<int>("width", 4);
    publisher_ = create_publisher<String>("image", SensorDataQoS());
    group_ = create_callback_group(CallbackGroupType::MutuallyExclusive);
    timer_ = create_wall_timer(1ms, std::bind(&Camera::tick, this), group_);
    SubscriptionOptions subscription_options;
    subscription_options.callback_group = group_;
    subscription_ = create_subscription<String>(
        "image", SensorDataQoS(),
        [this](String::ConstSharedPtr message) {
          RCLCPP_DEBUG(get_logger(), "%zu", message->data.size());
          received = message;
        },
        subscription_options);
  }
  String::ConstSharedPtr received;

 private:
  void tick() {
    auto message = std::make_unique<String>();
    message->data.resize(static_cast<std::size_t>(get_parameter("width").as_int()));
    const builtin_interfaces::msg::Time stamp = now();
    EXPECT_GT(stamp.sec, 0);
    publisher_->publish(std::move(message));
    timer_.reset();  // its own, in its callback
  }
  Publisher<String>::SharedPtr publisher_;
  Subscription<String>::SharedPtr subscription_;
  TimerBase::SharedPtr timer_;
  CallbackGroup::SharedPtr group_;
};

TEST_F(Nodes, ANodeInTheHabitsOfRclcppRuns) {
  const auto camera = std::make_shared<Camera>(NodeOptions());
  executors::MultiThreadedExecutor executor;
  executor.add_node(camera);
  ASSERT_TRUE(spin_until(executor, [&] { return camera->received != nullptr; }));
  EXPECT_EQ(camera->received->data.size(), 4u);
}

}  // namespace
}  // namespace rclcpp
