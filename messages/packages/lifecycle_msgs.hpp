// ROS 2's messages and services for nodes with a lifecycle, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_LIFECYCLE_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_LIFECYCLE_MSGS_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"

namespace takt::lifecycle_msgs {

/// State::id: the states in which a node rests, and those in which one of its callbacks runs.
enum class StateId : std::uint8_t {
  unknown = 0,
  unconfigured = 1,
  inactive = 2,
  active = 3,
  finalized = 4,

  configuring = 10,
  cleaningup = 11,
  shuttingdown = 12,
  activating = 13,
  deactivating = 14,
  errorprocessing = 15,
};

/// Transition::id: what can be asked for, and what follows from what a callback returns.
enum class TransitionId : std::uint8_t {
  create = 0,
  configure = 1,
  cleanup = 2,
  activate = 3,
  deactivate = 4,
  unconfigured_shutdown = 5,
  inactive_shutdown = 6,
  active_shutdown = 7,
  destroy = 8,

  on_configure_success = 10,
  on_configure_failure = 11,
  on_configure_error = 12,
  on_cleanup_success = 20,
  on_cleanup_failure = 21,
  on_cleanup_error = 22,
  on_activate_success = 30,
  on_activate_failure = 31,
  on_activate_error = 32,
  on_deactivate_success = 40,
  on_deactivate_failure = 41,
  on_deactivate_error = 42,
  on_shutdown_success = 50,
  on_shutdown_failure = 51,
  on_shutdown_error = 52,
  on_error_success = 60,
  on_error_failure = 61,
  on_error_error = 62,

  callback_success = 97,
  callback_failure = 98,
  callback_error = 99,
};

struct State {
  std::uint8_t id = 0;  // a StateId
  std::string label;
};
TAKT_MESSAGE(State, "lifecycle_msgs/msg/State", id, label);

struct Transition {
  std::uint8_t id = 0;  // a TransitionId
  std::string label;
};
TAKT_MESSAGE(Transition, "lifecycle_msgs/msg/Transition", id, label);

struct TransitionDescription {
  Transition transition;
  State start_state, goal_state;
};
TAKT_MESSAGE(TransitionDescription, "lifecycle_msgs/msg/TransitionDescription", transition,
             start_state, goal_state);

struct TransitionEvent {
  std::uint64_t timestamp = 0;  // nanoseconds
  Transition transition;
  State start_state, goal_state;
};
TAKT_MESSAGE(TransitionEvent, "lifecycle_msgs/msg/TransitionEvent", timestamp, transition,
             start_state, goal_state);

struct ChangeState {
  struct Request {
    Transition transition;  // its label, if there is one; else its id
  };
  struct Response {
    bool success = false;
  };
};
TAKT_MESSAGE(ChangeState::Request, "lifecycle_msgs/srv/ChangeState_Request", transition);
TAKT_MESSAGE(ChangeState::Response, "lifecycle_msgs/srv/ChangeState_Response", success);

struct GetState {
  struct Request {};
  struct Response {
    State current_state;
  };
};
TAKT_MESSAGE(GetState::Request, "lifecycle_msgs/srv/GetState_Request");
TAKT_MESSAGE(GetState::Response, "lifecycle_msgs/srv/GetState_Response", current_state);

struct GetAvailableStates {
  struct Request {};
  struct Response {
    std::vector<State> available_states;
  };
};
TAKT_MESSAGE(GetAvailableStates::Request, "lifecycle_msgs/srv/GetAvailableStates_Request");
TAKT_MESSAGE(GetAvailableStates::Response, "lifecycle_msgs/srv/GetAvailableStates_Response",
             available_states);

/// Also the type of get_transition_graph.
struct GetAvailableTransitions {
  struct Request {};
  struct Response {
    std::vector<TransitionDescription> available_transitions;
  };
};
TAKT_MESSAGE(GetAvailableTransitions::Request,
             "lifecycle_msgs/srv/GetAvailableTransitions_Request");
TAKT_MESSAGE(GetAvailableTransitions::Response,
             "lifecycle_msgs/srv/GetAvailableTransitions_Response", available_transitions);

}  // namespace takt::lifecycle_msgs

#endif  // TAKT_MESSAGES_PACKAGES_LIFECYCLE_MSGS_HPP_
