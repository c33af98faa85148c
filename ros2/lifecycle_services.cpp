// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/lifecycle_services.hpp"

#include <chrono>
#include <string>

#include "takt/base/logger.hpp"
#include "takt/messages/lifecycle_msgs/msg/transition_description.hpp"

namespace takt {
namespace {

using lifecycle_msgs::msg::TransitionDescription;
using lifecycle_msgs::msg::TransitionEvent;
using lifecycle_msgs::srv::ChangeState;
using lifecycle_msgs::srv::GetAvailableStates;
using lifecycle_msgs::srv::GetAvailableTransitions;
using lifecycle_msgs::srv::GetState;

lifecycle_msgs::msg::State to_message(LifecycleState state) {
  return lifecycle_msgs::msg::State()
      .set__id(static_cast<std::uint8_t>(state))
      .set__label(std::string(label(state)));
}

/// `Message`: a TransitionDescription or a TransitionEvent.
template <class Message>
Message to_message(const LifecycleTransition& transition) {
  Message message;
  message.transition.id = static_cast<std::uint8_t>(transition.id);
  message.transition.label = transition.label;
  message.start_state = to_message(transition.start);
  message.goal_state = to_message(transition.goal);
  return message;
}

// Messages carry system time: other machines do not know Takt's clocks.
std::uint64_t wall_time_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

void change_state(LifecycleNode& node, const lifecycle_msgs::msg::Transition& request,
                  ChangeState::Response& response) {
  // ROS 2's tools leave the id at 0 when they send a label, so a label has precedence.
  const TransitionResult result =
      request.label.empty() ? node.trigger_transition(static_cast<TransitionId>(request.id))
                            : node.trigger_transition(request.label);
  response.success = static_cast<bool>(result);
  if (!result) log(LogLevel::warn, "{}", result.message);
}

}  // namespace

LifecycleServices::LifecycleServices(LifecycleNode& node, Node& host,
                                     const std::shared_ptr<CallbackGroup>& group)
    : node_(node),
      transition_event_(
          host.create_publisher<TransitionEvent>(node.fully_qualified_name() + "/transition_event",
                                                 10, {.graph_node = node.fully_qualified_name()})),
      change_state_(host.create_service<ChangeState>(
          node.fully_qualified_name() + "/change_state",
          [&node, weak = node.weak_from_this()](const ChangeState::Request& request,
                                                ChangeState::Response& response) {
            const auto kept = weak.lock();  // a transition may drop the node
            change_state(node, request.transition, response);
          },
          group, rare_service(node.fully_qualified_name()))),
      get_state_(host.create_service<GetState>(
          node.fully_qualified_name() + "/get_state",
          [&node](const GetState::Request&, GetState::Response& response) {
            response.current_state = to_message(node.get_current_state());
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      get_available_states_(host.create_service<GetAvailableStates>(
          node.fully_qualified_name() + "/get_available_states",
          [](const GetAvailableStates::Request&, GetAvailableStates::Response& response) {
            for (const LifecycleState state : lifecycle_states()) {
              response.available_states.push_back(to_message(state));
            }
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      get_transitions_(host.create_service<GetAvailableTransitions>(
          node.fully_qualified_name() + "/get_available_transitions",
          [&node](const GetAvailableTransitions::Request&,
                  GetAvailableTransitions::Response& response) {
            for (const auto& transition : lifecycle_transitions(node.get_current_state())) {
              response.available_transitions.push_back(
                  to_message<TransitionDescription>(transition));
            }
          },
          nullptr, rare_service(node.fully_qualified_name()))),
      get_transition_graph_(host.create_service<GetAvailableTransitions>(
          node.fully_qualified_name() + "/get_transition_graph",
          [](const GetAvailableTransitions::Request&, GetAvailableTransitions::Response& response) {
            for (const auto& transition : lifecycle_transitions()) {
              response.available_transitions.push_back(
                  to_message<TransitionDescription>(transition));
            }
          },
          nullptr, rare_service(node.fully_qualified_name()))) {
  node.set_transition_listener([publisher = transition_event_](const auto& transition) {
    auto event = std::make_unique<TransitionEvent>(to_message<TransitionEvent>(transition));
    event->timestamp = wall_time_ns();
    publisher->publish(std::move(event));
  });
}

LifecycleServices::~LifecycleServices() {
  node_.set_transition_listener({});
}

}  // namespace takt
