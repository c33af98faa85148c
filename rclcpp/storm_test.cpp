// Threads make and drop what the pools of executors serve, all at the same time: `./dev stress`
// lets this run for minutes under the address and the thread sanitizer.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <functional>
#include <random>
#include <thread>

#include "takt/messages/example_interfaces/action/fibonacci.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/messages/std_srvs/srv/trigger.hpp"

#include "rclcpp_action/rclcpp_action.hpp"
#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using example_interfaces::action::Fibonacci;
using std_msgs::msg::String;
using std_srvs::srv::Trigger;
using ServerGoal = std::shared_ptr<rclcpp_action::ServerGoalHandle<Fibonacci>>;

class Storm : public RclcppTest {
 protected:
  Storm() {
    const char* const seconds = std::getenv("TAKT_STORM_SECONDS");
    end_ = std::chrono::steady_clock::now() +
           std::chrono::seconds(seconds != nullptr ? std::atoi(seconds) : 1);
    pool_.add_node(node_);
    events_.add_node(other_);
  }
  /// Again and again, on a thread of its own.
  void repeat(std::function<void(std::minstd_rand&)> round) {
    threads_.emplace_back([this, round = std::move(round), seed = threads_.size() + 1] {
      std::minstd_rand random(static_cast<unsigned>(seed));
      while (!is_over()) round(random);
    });
  }
  void of_messages();
  void of_services();
  void of_goals();
  bool is_over() const { return std::chrono::steady_clock::now() > end_; }
  /// Lets the others go on for up to two milliseconds.
  static void pause(std::minstd_rand& random) {
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 2000);
    EXPECT_TRUE(takt::eventually([&] { return std::chrono::steady_clock::now() >= until; }));
  }
  void join() {
    for (std::thread& thread : threads_) thread.join();
  }

  const Node::SharedPtr node_ = std::make_shared<Node>("node"),
                        other_ = std::make_shared<Node>("other"),
                        moved_ = std::make_shared<Node>("moved");
  const CallbackGroup::SharedPtr group_ =
                                     node_->create_callback_group(CallbackGroupType::Reentrant),
                                 others_ =
                                     other_->create_callback_group(CallbackGroupType::Reentrant);
  executors::MultiThreadedExecutor pool_{ExecutorOptions(), 3};
  experimental::executors::EventsExecutor events_;
  std::atomic<long> served_{0};

 private:
  std::chrono::steady_clock::time_point end_;
  std::vector<std::thread> threads_;
};

void Storm::of_messages() {
  repeat([&](auto& random) {
    SubscriptionOptions options;
    options.callback_group = others_;
    options.event_callbacks.matched_callback = [&](auto&) { ++served_; };
    const auto subscription = other_->create_subscription<String>(
        "topic", 10, [&](std::unique_ptr<String>) { ++served_; }, options);
    pause(random);
  });
  repeat([&](auto& random) {
    const auto publisher = node_->create_publisher<String>("topic", 10);
    for (int i = 0; i < 20; ++i) publisher->publish(String());
    pause(random);
  });
}

void Storm::of_services() {
  repeat([&](auto& random) {
    const auto service = other_->create_service<Trigger>(
        "service",
        [](Trigger::Request::SharedPtr, Trigger::Response::SharedPtr response) {
          response->success = true;
        },
        ServicesQoS(), others_);
    for (int i = 0; i < 4; ++i) pause(random);
  });
  repeat([&](auto& random) {  // clients go while answers come
    auto client = node_->create_client<Trigger>("service", ServicesQoS(), group_);
    std::vector<Client<Trigger>::SharedFuture> answers;
    for (int i = 0; i < 20; ++i) {
      answers.push_back(client
                            ->async_send_request(std::make_shared<Trigger::Request>(),
                                                 [&](Client<Trigger>::SharedFuture answer) {
                                                   served_ += answer.get()->success ? 1 : 0;
                                                 })
                            .future);
    }
    pause(random);
    if (random() % 2 == 0) client->prune_pending_requests();
    client.reset();
    for (const auto& answer : answers) EXPECT_EQ(answer.wait_for(0s), std::future_status::ready);
  });
}

void Storm::of_goals() {
  repeat([&](auto& random) {
    const auto server = rclcpp_action::create_server<Fibonacci>(
        other_, "fibonacci",
        [](auto&, auto) { return rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE; },
        [](auto) { return rclcpp_action::CancelResponse::ACCEPT; },
        [](const ServerGoal& goal) {
          goal->publish_feedback(std::make_shared<Fibonacci::Feedback>());
          goal->succeed(std::make_shared<Fibonacci::Result>());
        },
        rcl_action_server_get_default_options(), others_);
    for (int i = 0; i < 8; ++i) pause(random);
  });
  repeat([&](auto& random) {
    using ClientGoal = rclcpp_action::ClientGoalHandle<Fibonacci>::SharedPtr;
    auto client = rclcpp_action::create_client<Fibonacci>(node_, "fibonacci", group_);
    std::vector<std::shared_future<ClientGoal>> goals;
    for (int i = 0; i < 10; ++i) {
      rclcpp_action::Client<Fibonacci>::SendGoalOptions options;
      options.goal_response_callback = [&](const ClientGoal& goal) { served_ += goal != nullptr; };
      options.feedback_callback = [&](auto, auto) { ++served_; };
      if (i % 2 == 0) options.result_callback = [&](auto&) { ++served_; };
      goals.push_back(client->async_send_goal({}, options));
    }
    pause(random);
    for (const auto& goal : goals) {
      if (goal.wait_for(0s) != std::future_status::ready || goal.get() == nullptr) continue;
      client->async_get_result(goal.get(), [&](auto&) { ++served_; });
      if (random() % 2 == 0) client->async_cancel_goal(goal.get());
    }
  });
}

TEST_F(Storm, OfWhatIsMadeAndDropped) {
  const Spinner spins_pool(pool_), spins_events(events_);
  const auto timer = moved_->create_wall_timer(500us, [&] { ++served_; });
  node_->declare_parameter("value", 0);
  ParameterEventHandler handler(node_);
  of_messages();
  of_services();
  of_goals();
  repeat([&](auto& random) {  // a node moves
    Executor& executor = random() % 2 == 0 ? static_cast<Executor&>(pool_) : events_;
    executor.add_node(moved_);
    pause(random);
    executor.remove_node(moved_);
  });
  repeat([&](auto& random) {  // timers, one of which drops itself
    const auto own = std::make_shared<TimerBase::SharedPtr>();
    const TimerBase::SharedPtr made = other_->create_wall_timer(
        10us,
        [weak = std::weak_ptr(own)] {
          if (const auto self = weak.lock()) self->reset();
        },
        others_, false);
    *own = made;
    if (random() % 2 == 0) made->reset();
    const auto plain = node_->create_wall_timer(
        10us, [&] { ++served_; }, group_);
    pause(random);
  });
  repeat([&](auto& random) {  // callbacks of parameters
    const auto on_set = node_->add_on_set_parameters_callback([&](const auto&) {
      ++served_;
      return rcl_interfaces::msg::SetParametersResult().set__successful(true);
    });
    const auto on_event = handler.add_parameter_event_callback([&](const auto&) { ++served_; });
    pause(random);
  });
  repeat([&](auto& random) {
    node_->set_parameter(Parameter("value", static_cast<std::int64_t>(random() % 100)));
    pause(random);
  });
  repeat([&](auto& random) {  // a wait set that changes while it is waited for
    const auto kept = std::make_shared<GuardCondition>(),
               added = std::make_shared<GuardCondition>();
    ThreadSafeWaitSet set({}, {kept});
    std::thread waits([&] {
      EXPECT_TRUE(takt::eventually([&] { return set.wait(1s).kind() == WaitResultKind::Ready; }));
    });
    set.add_guard_condition(added);
    pause(random);
    set.remove_guard_condition(added);
    kept->trigger();
    waits.join();
  });
  join();
  EXPECT_GT(served_, 0);
}

// Each round several threads shut down, also in a callback, while others remove what is called
// then.
TEST_F(Storm, OfShutdowns) {
  std::atomic<int> rounds{0};
  repeat([&](auto& random) {
    const auto context = std::make_shared<Context>();
    context->init(0, nullptr);
    NodeOptions of_context;
    of_context.context(context);
    ExecutorOptions how;
    how.context = context;
    const auto node = std::make_shared<Node>("node", of_context);
    executors::SingleThreadedExecutor executor(how);
    executor.add_node(node);
    std::atomic<int> calls{0};
    std::atomic<bool> is_removed{false};
    auto timer = node->create_wall_timer(50us, [&] { context->shutdown("callback"); });
    context->add_pre_shutdown_callback([&] { ++calls; });
    const auto removed = context->add_on_shutdown_callback([&] { EXPECT_FALSE(is_removed); });
    context->add_on_shutdown_callback([&] {
      timer.reset();
      ++calls;
    });
    std::vector<std::thread> others;
    others.emplace_back([&] { executor.spin(); });
    others.emplace_back([&] {
      context->remove_on_shutdown_callback(removed);
      is_removed = true;
    });
    others.emplace_back([&] {
      context->shutdown("thread");
      EXPECT_EQ(calls, 2);
    });
    pause(random);
    for (std::thread& other : others) other.join();
    ++rounds;
  });
  join();
  EXPECT_GT(rounds, 0);
}

}  // namespace
}  // namespace rclcpp
