// Tests of the services by which others see and change the state of a node.
// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/lifecycle_services.hpp"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/entities/client.hpp"

namespace takt {
namespace {

using lifecycle_msgs::msg::TransitionEvent;
using namespace lifecycle_msgs::srv;
using testing::ElementsAre;

class FailingNode : public LifecycleNode {
 public:
  using LifecycleNode::LifecycleNode;
  CallbackReturn result = CallbackReturn::SUCCESS;

 private:
  CallbackReturn on_configure(LifecycleState) override { return result; }
};

// What an executor does, without one.
void serve_all(const Node& node) {
  for (const auto& entity : node.entities()) {
    for (Slot slot; entity->take(slot);) entity->execute(slot);
  }
}

class LifecycleServicesTest : public testing::Test {
 protected:
  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request = {}) {
    const auto client = caller_->create_client<S>("/front/camera/" + service);
    EXPECT_TRUE(client->service_is_ready()) << service;
    const auto future = client->async_send_request(request);
    serve_all(*host_);
    serve_all(*caller_);
    EXPECT_TRUE(future.ready()) << service;
    return future.ready() ? future.get().value() : typename S::Response{};
  }
  bool change(const std::string& label, TransitionId id = TransitionId::create) {
    ChangeState::Request request;
    request.transition.set__id(static_cast<std::uint8_t>(id)).set__label(label);
    return call<ChangeState>("change_state", request).success;
  }
  std::string state() { return call<GetState>("get_state").current_state.label; }
  std::vector<std::string> available() {
    std::vector<std::string> labels;
    for (const auto& each :
         call<GetAvailableTransitions>("get_available_transitions").available_transitions) {
      labels.push_back(each.transition.label);
      EXPECT_EQ(each.start_state.label, state());
    }
    return labels;
  }

  const std::shared_ptr<FailingNode> node_ =
      std::make_shared<FailingNode>("camera", NodeOptions{.name_space = "/front"});
  const std::shared_ptr<Node> host_ = std::make_shared<Node>("container");
  const std::shared_ptr<Node> caller_ = std::make_shared<Node>("caller");
  std::optional<LifecycleServices> services_{std::in_place, *node_, *host_};
};

TEST(LifecycleMessages, AreOnTheWireAsThoseOfRos2) {
  TransitionEvent event;
  event.timestamp = 7;
  event.transition.set__id(1).set__label("a");
  event.start_state.set__id(2).set__label("b");
  event.goal_state.set__id(3).set__label("c");
  ByteBuffer buffer;
  message_type<TransitionEvent>().encode(&event, buffer);
  std::vector<int> bytes;
  for (const std::byte byte : buffer.bytes()) bytes.push_back(static_cast<int>(byte));
  EXPECT_THAT(bytes, ElementsAre(0, 1, 0, 0,                      // encapsulation
                                 7, 0, 0, 0, 0, 0, 0, 0,          // timestamp
                                 1, 0, 0, 0, 2, 0, 0, 0, 'a', 0,  // a string is aligned, and ends
                                 2, 0, 2, 0, 0, 0, 'b', 0,        // in a zero
                                 3, 0, 2, 0, 0, 0, 'c', 0));
  EXPECT_EQ(message_type<TransitionEvent>().name, "lifecycle_msgs/msg/TransitionEvent");
  EXPECT_EQ(message_type<ChangeState::Request>().name, "lifecycle_msgs/srv/ChangeState_Request");
  EXPECT_EQ(message_type<GetAvailableTransitions::Response>().name,
            "lifecycle_msgs/srv/GetAvailableTransitions_Response");
}

TEST_F(LifecycleServicesTest, BelongToTheHost) {
  EXPECT_EQ(host_->entities().size(), 5u);
  EXPECT_TRUE(node_->entities().empty());
}

TEST_F(LifecycleServicesTest, ChangeTheStateByIdOrLabel) {
  EXPECT_EQ(state(), "unconfigured");
  EXPECT_TRUE(change("", TransitionId::configure));
  EXPECT_EQ(state(), "inactive");
  EXPECT_TRUE(change("activate"));
  EXPECT_EQ(call<GetState>("get_state").current_state.id, 3);
  EXPECT_TRUE(change("shutdown"));
  EXPECT_EQ(state(), "finalized");
}

TEST_F(LifecycleServicesTest, TheLabelBeatsTheId) {
  EXPECT_TRUE(change("configure", TransitionId::unconfigured_shutdown));
  EXPECT_EQ(state(), "inactive");
  EXPECT_FALSE(change("nonsense", TransitionId::activate));
  EXPECT_EQ(state(), "inactive");
}

TEST_F(LifecycleServicesTest, ShutdownByLabelWorksInEachOfTheThreeStates) {
  for (const int steps : {0, 1, 2}) {
    services_.reset();
    const auto node =
        std::make_shared<LifecycleNode>("camera", NodeOptions{.name_space = "/front"});
    services_.emplace(*node, *host_);
    if (steps > 0) {
      EXPECT_TRUE(change("configure"));
    }
    if (steps > 1) {
      EXPECT_TRUE(change("activate"));
    }
    EXPECT_TRUE(change("shutdown"));
    EXPECT_EQ(node->get_current_state(), LifecycleState::finalized);
    services_.reset();
  }
}

// rclcpp's answer comes from a variable that nobody has written (lifecycle_node_interface_impl).
TEST_F(LifecycleServicesTest, WhatCannotBeIsAnsweredWithoutSuccess) {
  EXPECT_FALSE(change("", TransitionId::activate));
  EXPECT_FALSE(change("", TransitionId::on_configure_success));
  EXPECT_FALSE(change("", static_cast<TransitionId>(200)));
  EXPECT_FALSE(change("", TransitionId::active_shutdown));  // that of another state
  EXPECT_EQ(state(), "unconfigured");
}

TEST_F(LifecycleServicesTest, AFailureAndAnErrorAreAnsweredWithoutSuccess) {
  node_->result = CallbackReturn::FAILURE;
  EXPECT_FALSE(change("configure"));
  EXPECT_EQ(state(), "unconfigured");
  node_->result = CallbackReturn::ERROR;
  EXPECT_FALSE(change("configure"));
  EXPECT_EQ(state(), "finalized");
}

TEST_F(LifecycleServicesTest, ListWhatThereIsAndWhatIsPossible) {
  const auto states = call<GetAvailableStates>("get_available_states").available_states;
  ASSERT_EQ(states.size(), 11u);
  EXPECT_EQ(states.back().id, 15);
  EXPECT_EQ(states.back().label, "errorprocessing");
  const auto graph = call<GetAvailableTransitions>("get_transition_graph").available_transitions;
  ASSERT_EQ(graph.size(), 25u);
  EXPECT_EQ(graph[1].transition.id, 10);
  EXPECT_EQ(graph[1].transition.label, "transition_success");
  EXPECT_EQ(graph[1].start_state.label, "configuring");
  EXPECT_EQ(graph[1].goal_state.label, "inactive");
  EXPECT_THAT(available(), ElementsAre("configure", "shutdown"));
  EXPECT_TRUE(change("configure"));
  EXPECT_THAT(available(), ElementsAre("cleanup", "activate", "shutdown"));
  EXPECT_TRUE(change("activate"));
  EXPECT_THAT(available(), ElementsAre("deactivate", "shutdown"));
  EXPECT_TRUE(change("shutdown"));
  EXPECT_THAT(available(), ElementsAre());
}

TEST_F(LifecycleServicesTest, ReportEveryStateThatTheNodePasses) {
  std::vector<std::string> path;
  std::uint64_t last_time = 0;
  const auto events = caller_->create_subscription<TransitionEvent>(
      "/front/camera/transition_event", 10, [&](const TransitionEvent& event) {
        path.push_back(event.start_state.label + " " + std::to_string(event.transition.id) + " " +
                       event.goal_state.label);
        EXPECT_GE(event.timestamp, last_time);
        last_time = event.timestamp;
      });
  EXPECT_TRUE(node_->configure());  // by whomever
  node_->cleanup();
  node_->result = CallbackReturn::ERROR;
  EXPECT_FALSE(change("configure"));
  serve_all(*caller_);
  EXPECT_THAT(path, ElementsAre("unconfigured 1 configuring", "configuring 10 inactive",
                                "inactive 2 cleaningup", "cleaningup 20 unconfigured",
                                "unconfigured 1 configuring", "configuring 12 errorprocessing",
                                "errorprocessing 61 finalized"));
  EXPECT_GT(last_time, 0u);
}

TEST_F(LifecycleServicesTest, TheNodeMayBeItsOwnHost) {
  services_.reset();
  services_.emplace(*node_, *node_);
  const auto client = caller_->create_client<ChangeState>("/front/camera/change_state");
  ChangeState::Request request;
  request.transition.label = "configure";
  const auto future = client->async_send_request(request);
  serve_all(*node_);  // services work in every state
  serve_all(*caller_);
  ASSERT_TRUE(future.ready());
  EXPECT_TRUE(future.get()->success);
  services_.reset();
  EXPECT_TRUE(node_->activate());  // there is no listener any more
}

}  // namespace
}  // namespace takt
