// The states and transitions of lifecycle nodes: ROS 2's table.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_
#define TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/messages/packages/lifecycle_msgs.hpp"

namespace takt {

// Source of the table: design.ros2.org/articles/node_lifecycle.html, with the ids, labels and order
// of rcl_lifecycle. Nothing here changes or throws, so it may be used from any thread.

using LifecycleState = lifecycle_msgs::StateId;
using TransitionId = lifecycle_msgs::TransitionId;

/// What a callback of a transition returns.
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
/// What leads away from this state.
std::vector<LifecycleTransition> lifecycle_transitions(LifecycleState from);

/// What can be asked for in this state; nullptr when this cannot. "shutdown" is the label of three
/// transitions, one from each state, each with an id of its own.
const LifecycleTransition* find_transition(LifecycleState from, TransitionId id) noexcept;
const LifecycleTransition* find_transition(LifecycleState from, std::string_view label) noexcept;
/// What follows when the callback of a transition state (`during`) returns this.
const LifecycleTransition& find_result(LifecycleState during, CallbackReturn result) noexcept;

/// For messages: "'activate' (3), 'shutdown' (6)", or "none".
std::string describe_transitions(LifecycleState from);

}  // namespace takt

#endif  // TAKT_NODES_LIFECYCLE_STATE_MACHINE_HPP_
