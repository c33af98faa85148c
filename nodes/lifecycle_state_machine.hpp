// The states and transitions of lifecycle nodes: ROS 2's table. lifecycle_node.cpp goes through it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_
#define TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

// Source of the table: design.ros2.org/articles/node_lifecycle.html, with the ids, labels and order
// of rcl_lifecycle. Nothing here changes or throws, so it may be used from any thread.

/// The id of lifecycle_msgs/msg/State: the states in which a node rests, and those in which one of
/// its callbacks runs.
enum class LifecycleState : std::uint8_t {
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

/// The id of lifecycle_msgs/msg/Transition: what can be requested, and what follows from the result
/// of a callback.
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
};

/// The result of a callback of a transition.
enum class CallbackReturn : std::uint8_t {
  SUCCESS = 97,
  FAILURE = 98,  // the node stays as it was; shutting down goes on nevertheless
  ERROR = 99,    // the node does not know how it is: on_error decides
};

/// One row of the table.
struct LifecycleTransition {
  TransitionId id;
  std::string_view label;
  LifecycleState start, goal;
};

/// "unconfigured", "activating", … as in ROS 2.
std::string_view label(LifecycleState state) noexcept;
/// Whether nodes rest in it: no callback of a transition runs.
bool is_primary(LifecycleState state) noexcept;

std::span<const LifecycleState> lifecycle_states() noexcept;
std::span<const LifecycleTransition> lifecycle_transitions() noexcept;
/// The transitions from this state.
std::vector<LifecycleTransition> lifecycle_transitions(LifecycleState from);

/// What can be asked for in this state; nullptr when this cannot. "shutdown" is the label of three
/// transitions, one from each state, each with an id of its own.
const LifecycleTransition* find_transition(LifecycleState from, TransitionId id) noexcept;
const LifecycleTransition* find_transition(LifecycleState from, std::string_view label) noexcept;
/// The state after the callback of a transition state (`during`) has returned this.
const LifecycleTransition& find_result(LifecycleState during, CallbackReturn result) noexcept;

/// For messages: "'activate' (3), 'shutdown' (6)", or "none".
std::string describe_transitions(LifecycleState from);

}  // namespace takt

#endif  // TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_
