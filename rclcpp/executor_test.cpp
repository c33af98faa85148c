// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <future>

#include "takt/messages/example_interfaces/srv/add_two_ints.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using example_interfaces::srv::AddTwoInts;
using Executors = RclcppTest;

TEST_F(Executors, ANodeBelongsToOneAtATime) {
  const auto node = std::make_shared<Node>("node");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  executors::SingleThreadedExecutor other;
  EXPECT_THROW(other.add_node(node), std::runtime_error);
  EXPECT_THROW(spin_some(node), std::runtime_error);
  executor.remove_node(node);
  EXPECT_THROW(executor.remove_node(node), std::runtime_error);
  spin_some(node);
}

// Its list of groups kept those of nodes that had gone, for as long as the executor lived.
TEST_F(Executors, KeepsNoGroupThatWasAdded) {
  auto node = std::make_shared<Node>("node");
  auto group = node->create_callback_group(CallbackGroupType::Reentrant, false);
  executors::SingleThreadedExecutor executor;
  executor.add_callback_group(group, node->get_node_base_interface());
  const std::weak_ptr<CallbackGroup> gone = group;
  group.reset();
  node.reset();
  executor.spin_some();
  EXPECT_TRUE(gone.expired());
}

TEST_F(Executors, SpinSomeLosesNothingBetweenCalls) {
  const auto node = std::make_shared<Node>("node");
  const auto client = node->create_client<AddTwoInts>("add");
  const auto service = node->create_service<AddTwoInts>(
      "add", [](const AddTwoInts::Request::SharedPtr request,
                AddTwoInts::Response::SharedPtr response) { response->sum = request->a + 1; });
  ASSERT_TRUE(client->wait_for_service(kLong));  // nobody spins
  auto request = std::make_shared<AddTwoInts::Request>();
  request->a = 41;
  auto future = client->async_send_request(request);
  const auto end = std::chrono::steady_clock::now() + kLong;
  while (ok() && future.wait_for(0s) != std::future_status::ready &&
         std::chrono::steady_clock::now() < end) {
    spin_some(node);
  }
  ASSERT_EQ(future.wait_for(0s), std::future_status::ready);
  EXPECT_EQ(future.get()->sum, 42);
}

TEST_F(Executors, AFutureIsSpunFor) {
  const auto node = std::make_shared<Node>("node");
  const auto service = node->create_service<AddTwoInts>(
      "add",
      [](std::shared_ptr<rmw_request_id_t>, const std::shared_ptr<AddTwoInts::Request> request,
         std::shared_ptr<AddTwoInts::Response> response) { response->sum = request->a; });
  const auto client = node->create_client<AddTwoInts>("add");
  auto result = client->async_send_request(std::make_shared<AddTwoInts::Request>());
  EXPECT_EQ(spin_until_future_complete(node, result, kLong), FutureReturnCode::SUCCESS);
  std::promise<void> never;
  EXPECT_EQ(spin_until_future_complete(node, never.get_future().share(), 1ms),
            FutureReturnCode::TIMEOUT);
  bool is_called = false;
  auto called = client->async_send_request(
      std::make_shared<AddTwoInts::Request>(), [&](Client<AddTwoInts>::SharedFuture future) {
        is_called = future.wait_for(0s) == std::future_status::ready;
      });
  EXPECT_EQ(spin_until_future_complete(node, called.future, kLong), FutureReturnCode::SUCCESS);
  EXPECT_TRUE(is_called);
}

TEST_F(Executors, AnAnswerMayComeLater) {
  const auto node = std::make_shared<Node>("node");
  std::shared_ptr<rmw_request_id_t> asked;
  const auto service = node->create_service<AddTwoInts>(
      "add", [&](std::shared_ptr<rmw_request_id_t> header, std::shared_ptr<AddTwoInts::Request>) {
        asked = header;
      });
  const auto client = node->create_client<AddTwoInts>("add");
  auto future = client->async_send_request(std::make_shared<AddTwoInts::Request>());
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  ASSERT_TRUE(spin_until(executor, [&] { return asked != nullptr; }));
  AddTwoInts::Response response;
  response.sum = 3;
  service->send_response(*asked, response);
  ASSERT_EQ(executor.spin_until_future_complete(future, kLong), FutureReturnCode::SUCCESS);
  EXPECT_EQ(future.get()->sum, 3);
  auto forgotten = client->async_send_request(std::make_shared<AddTwoInts::Request>());
  EXPECT_TRUE(client->remove_pending_request(forgotten));
  EXPECT_FALSE(client->remove_pending_request(forgotten));
  EXPECT_EQ(client->prune_pending_requests(), 0u);
}

// A program asks for introspection to be off, which it is; asks for more in vain.
TEST_F(Executors, ThereIsNoServiceIntrospection) {
  const auto node = std::make_shared<Node>("node");
  const auto client = node->create_client<AddTwoInts>("add");
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  client->configure_introspection(node->get_clock(), QoS(1), RCL_SERVICE_INTROSPECTION_OFF);
  EXPECT_THROW(client->configure_introspection(node->get_clock(), QoS(1),
                                               RCL_SERVICE_INTROSPECTION_CONTENTS),
               exceptions::RCLError);
#pragma GCC diagnostic pop
}

TEST_F(Executors, CancelFromACallbackEndsOneSpin) {
  const auto node = std::make_shared<Node>("node");
  executors::MultiThreadedExecutor executor(ExecutorOptions(), 2);
  int calls = 0;
  const auto timer = node->create_wall_timer(1ms, [&](TimerBase& self) {
    EXPECT_THROW(executor.spin(), std::runtime_error);
    ++calls;
    self.cancel();
    executor.cancel();
  });
  executor.add_node(node);
  executor.spin();
  EXPECT_EQ(calls, 1);
  EXPECT_TRUE(timer->is_canceled());
  timer->reset();
  executor.spin();
  EXPECT_EQ(calls, 2);
}

// tf2_ros drops a timer while it holds the mutex of its buffer, for which a callback waits: both
// waited for ever.
TEST_F(Executors, AThreadDropsEntitiesThoughACallbackWaitsForIt) {
  const auto node = std::make_shared<Node>("node");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  std::promise<void> has_begun, is_dropped;
  bool went_on = false, ran_again = false;
  auto waits = node->create_wall_timer(1ms, [&](TimerBase& self) {
    self.cancel();
    has_begun.set_value();
    went_on = is_dropped.get_future().wait_for(10s) == std::future_status::ready;
  });
  auto other = node->create_wall_timer(1h, [&] { ran_again = true; });
  std::thread spins([&] { executor.spin(); });
  has_begun.get_future().wait();
  other->execute_callback();
  EXPECT_TRUE(std::exchange(ran_again, false));
  other.reset();
  waits.reset();
  is_dropped.set_value();
  const auto end = node->create_wall_timer(1ms, [&] { executor.cancel(); });
  spins.join();
  EXPECT_TRUE(went_on);
  EXPECT_FALSE(ran_again);
}

// As in rclcpp since 2026-07: the thread that spins may come too late.
TEST_F(Executors, ACancelBeforeASpinEndsThatAndNoOther) {
  const auto node = std::make_shared<Node>("node");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  int calls = 0;
  const auto timer = node->create_wall_timer(1ms, [&] {
    ++calls;
    executor.cancel();
  });
  executor.cancel();
  executor.spin();
  EXPECT_EQ(calls, 0);
  executor.spin();
  EXPECT_EQ(calls, 1);
}

// The end of the spin removed the node once more, and the exception of that left a destructor: the
// process ended, and what the callback had thrown was lost.
TEST_F(Executors, ACallbackMayRemoveItsNodeFromTheExecutorThatSpinsIt) {
  const auto node = std::make_shared<Node>("node");
  executors::SingleThreadedExecutor executor, other;
  bool has_run = false, throws = false;
  const auto timer = node->create_wall_timer(1ms, [&] {
    has_run = true;
    executor.remove_node(node);
    if (throws) throw std::runtime_error("of the callback");
    other.add_node(node);
  });
  const auto spins = std::vector<std::function<void()>>{
      [&] { executor.spin_node_once(node, 10ms); }, [&] { executor.spin_node_some(node); },
      [&] {
        std::promise<void> never;
        executors::spin_node_until_future_complete(executor, node, never.get_future().share(),
                                                   10ms);
      }};
  for (const auto& spin : spins) {
    for (has_run = throws = false; !has_run;) spin();
    EXPECT_THROW(executor.remove_node(node), std::runtime_error);
    other.remove_node(node);  // which it has left to it
    throws = true;
    EXPECT_THROW(
        while (true) { spin(); }, std::runtime_error);
  }
}

// Pruning those before a time forgot that there were others.
TEST_F(Executors, RequestsArePrunedByTheirTime) {
  const auto node = std::make_shared<Node>("node");
  const auto client = node->create_client<AddTwoInts>("nobody");
  const auto send = [&] {
    return client->async_send_request(std::make_shared<AddTwoInts::Request>()).request_id;
  };
  const std::int64_t first = send();
  std::chrono::system_clock::time_point middle = std::chrono::system_clock::now();
  while (std::chrono::system_clock::now() == middle) {
  }
  middle = std::chrono::system_clock::now();
  send();
  std::vector<std::int64_t> pruned;
  EXPECT_EQ(client->prune_requests_older_than(middle, &pruned), 1u);
  EXPECT_EQ(pruned, std::vector<std::int64_t>{first});
  EXPECT_EQ(client->prune_requests_older_than(middle), 0u);
  EXPECT_EQ(client->prune_pending_requests(), 1u);
  EXPECT_EQ(client->prune_pending_requests(), 0u);
}

TEST_F(Executors, ASignalEndsWhateverWaits) {
  const auto node = std::make_shared<Node>("node");
  const auto timer = node->create_wall_timer(1ms, [] { std::raise(SIGINT); });
  auto sleeper = std::async(std::launch::async, [] { return sleep_for(kLong); });
  spin(node);
  EXPECT_FALSE(sleeper.get());
  EXPECT_FALSE(ok());
  EXPECT_FALSE(shutdown());
  const auto client = node->create_client<AddTwoInts>("nobody");
  EXPECT_FALSE(client->wait_for_service());
  EXPECT_THROW(std::make_shared<Node>("late"), exceptions::RCLInvalidArgument);
}

}  // namespace
}  // namespace rclcpp
