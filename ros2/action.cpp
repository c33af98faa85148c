// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action.hpp"

#include <algorithm>
#include <random>

#include <fmt/format.h>

namespace takt {

GoalId new_goal_id() {
  std::random_device random;
  GoalId id;
  std::generate(id.uuid.begin(), id.uuid.end(),
                [&] { return static_cast<std::uint8_t>(random()); });
  return id;
}

std::string to_string(const GoalId& id) {
  return fmt::format("{:02x}", fmt::join(id.uuid, ""));
}

std::string_view to_string(GoalState state) noexcept {
  switch (state) {
    case GoalState::unknown:
      return "unknown";
    case GoalState::accepted:
      return "accepted";
    case GoalState::executing:
      return "executing";
    case GoalState::canceling:
      return "canceling";
    case GoalState::succeeded:
      return "succeeded";
    case GoalState::canceled:
      return "canceled";
    case GoalState::aborted:
      return "aborted";
  }
  return "?";
}

}  // namespace takt
