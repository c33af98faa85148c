// Shutting down from several threads, and what is removed while callbacks run.
// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <future>

#include "takt/messages/rcl_interfaces/msg/parameter_event.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

using Shutdown = RclcppTest;

/// Opens once, for all.
class Gate {
 public:
  void open() { promise_.set_value(); }
  void wait() const { ASSERT_EQ(future_.wait_for(kLong), std::future_status::ready); }

 private:
  std::promise<void> promise_;
  const std::shared_future<void> future_{promise_.get_future()};
};

// The second thread called what runs before a shutdown once more, and went on while the callbacks
// of the first one ran: main then destroyed what these used.
TEST_F(Shutdown, EveryThreadReturnsWhenAllIsOver) {
  const auto context = std::make_shared<Context>();
  context->init(0, nullptr);
  Gate begun, may_end;
  std::atomic<int> before{0}, after{0};
  std::atomic<bool> is_over{false};
  context->add_pre_shutdown_callback([&] {
    ++before;
    begun.open();
    EXPECT_FALSE(context->shutdown("in a callback, which waits for nothing"));
    may_end.wait();
  });
  context->add_on_shutdown_callback([&] {
    ++after;
    is_over = true;
  });
  auto first = std::async(std::launch::async, [&] { return context->shutdown("first"); });
  begun.wait();
  auto second = std::async(std::launch::async, [&] {
    const bool was_valid = context->shutdown("second");
    EXPECT_TRUE(is_over);
    return was_valid;
  });
  EXPECT_EQ(second.wait_for(10ms), std::future_status::timeout);
  may_end.open();
  EXPECT_TRUE(first.get());
  EXPECT_FALSE(second.get());
  EXPECT_EQ(before, 1);
  EXPECT_EQ(after, 1);
  EXPECT_EQ(context->shutdown_reason(), "first");
}

// Callbacks were called from a copy of their list, with what a removal had let go.
TEST_F(Shutdown, WhatIsRemovedIsNotCalled) {
  const auto context = std::make_shared<Context>();
  context->init(0, nullptr);
  int called = 0;
  OnShutdownCallbackHandle second;
  context->add_on_shutdown_callback(
      [&] { EXPECT_TRUE(context->remove_on_shutdown_callback(second)); });
  second = context->add_on_shutdown_callback([&] { ++called; });
  EXPECT_FALSE(context->remove_pre_shutdown_callback(second));
  context->shutdown("");
  EXPECT_EQ(called, 0);
  EXPECT_FALSE(context->remove_on_shutdown_callback(second));
}

// The destructor of a context ended the process.
TEST_F(Shutdown, ACallbackThatThrowsKeepsNoOtherFromItsCall) {
  auto context = std::make_shared<Context>();
  context->init(0, nullptr);
  int called = 0;
  context->add_on_shutdown_callback([] { throw std::runtime_error("first"); });
  context->add_on_shutdown_callback([&] { ++called; });
  EXPECT_THROW(context->shutdown(""), std::runtime_error);
  context->init(0, nullptr);
  context.reset();
  EXPECT_EQ(called, 2);
}

// A callback of an executor shuts down, while the thread that shuts down waits for it.
TEST_F(Shutdown, DoesNotWaitForWhoWaitsForIt) {
  const auto node = std::make_shared<Node>("node");
  Gate runs, begun;
  auto timer = node->create_wall_timer(1ms, [&](TimerBase& self) {
    self.cancel();
    runs.open();
    begun.wait();
    EXPECT_FALSE(shutdown());
  });
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  const auto context = contexts::get_global_default_context();  // of other tests, too
  const auto handle = context->add_on_shutdown_callback([&] {
    begun.open();
    timer.reset();  // waits for the callback
  });
  auto spin = std::async(std::launch::async, [&] { executor.spin(); });
  runs.wait();
  EXPECT_TRUE(shutdown());
  EXPECT_EQ(spin.wait_for(kLong), std::future_status::ready);
  context->remove_on_shutdown_callback(handle);
}

using Removals = RclcppTest;
using Event = rcl_interfaces::msg::ParameterEvent;

TEST(ParameterEvents, AreThoseOfTheNamedNode) {
  Event event;
  event.node = "/mine";
  event.changed_parameters.emplace_back().name = "gain";
  Parameter found;
  EXPECT_TRUE(ParameterEventHandler::get_parameter_from_event(event, found, "gain", "/mine"));
  EXPECT_TRUE(ParameterEventHandler::get_parameter_from_event(event, found, "gain", ""));
  EXPECT_FALSE(ParameterEventHandler::get_parameter_from_event(event, found, "gain", "/other"));
}

TEST_F(Removals, CallbacksOfParameterEventsAreNotCalledAfterwards) {
  const auto node = std::make_shared<Node>("node");
  node->declare_parameter("value", 1);
  ParameterEventHandler handler(node), other(node);
  int called = 0;
  ParameterEventCallbackHandle::SharedPtr removed, dropped;
  removed = handler.add_parameter_event_callback([&](const Event&) { ++called; });
  dropped = handler.add_parameter_event_callback([&](const Event&) { ++called; });
  bool is_told = false;
  const auto first = handler.add_parameter_event_callback([&](const Event&) {
    if (std::exchange(is_told, true)) return;
    handler.remove_parameter_event_callback(removed);
    dropped.reset();
  });
  EXPECT_THROW(other.remove_parameter_event_callback(removed), std::runtime_error);
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  EXPECT_TRUE(spin_until(executor, [&] {
    node->set_parameter(Parameter("value", 2));
    return is_told;
  }));
  EXPECT_EQ(called, 0);
  EXPECT_THROW(handler.remove_parameter_event_callback(removed), std::runtime_error);
}

// The one that removed a callback destroyed what that used, while another thread was in it.
TEST_F(Removals, WaitForACallOfAnotherThread) {
  const auto node = std::make_shared<Node>("node");
  node->declare_parameter("value", 1);
  Gate begun, may_end;
  std::atomic<bool> has_ended{false};
  auto handle = node->add_on_set_parameters_callback([&](const std::vector<Parameter>&) {
    begun.open();
    may_end.wait();
    has_ended = true;
    return rcl_interfaces::msg::SetParametersResult().set__successful(true);
  });
  auto setter = std::async(std::launch::async, [&] { node->set_parameter(Parameter("value", 2)); });
  begun.wait();
  auto remover = std::async(std::launch::async, [&] {
    node->remove_on_set_parameters_callback(handle.get());
    EXPECT_TRUE(has_ended);
  });
  EXPECT_EQ(remover.wait_for(10ms), std::future_status::timeout);
  may_end.open();
  remover.get();
  setter.get();
  EXPECT_THROW(node->remove_on_set_parameters_callback(handle.get()), std::runtime_error);
  const auto other = std::make_shared<Node>("other");
  const auto foreign = other->add_post_set_parameters_callback([](const auto&) {});
  EXPECT_THROW(node->remove_post_set_parameters_callback(foreign.get()), std::runtime_error);
}

// A callback of parameters that a service calls dropped the node, whose memory the service used.
TEST_F(Removals, ANodeMayGoInACallbackOfItsParameters) {
  auto node = std::make_shared<Node>("node");
  node->declare_parameter("a", 1);
  node->declare_parameter("b", 1);
  const auto client_node = std::make_shared<Node>("client");
  AsyncParametersClient client(client_node, "node");
  executors::SingleThreadedExecutor executor, own;
  executor.add_node(client_node);
  own.add_node(node);
  std::weak_ptr<Node> weak = node;
  const auto handle = node->add_post_set_parameters_callback([&](const auto&) { node.reset(); });
  const Spinner spinner(own);
  ASSERT_TRUE(client.wait_for_service(kLong));
  auto answers = client.set_parameters({Parameter("a", 2), Parameter("b", 2)});
  EXPECT_TRUE(takt::eventually([&] { return weak.expired(); }));
  executor.spin_until_future_complete(answers, 1ms);  // it may have no service any more
}

}  // namespace
}  // namespace rclcpp
