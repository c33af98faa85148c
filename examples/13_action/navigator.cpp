// An action server as a component: drives a metre a second towards the goal.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"
#include "takt/ros2/action_server.hpp"

#include "navigate.hpp"

namespace demo {

class Navigator : public takt::Node {
 public:
  using Goal = takt::ServerGoalHandle<Navigate>;

  explicit Navigator(const takt::NodeOptions& options)
      : Node("navigator", options),
        server_(takt::create_action_server<Navigate>(
            *this, "navigate_to_pose",
            [](const takt::GoalId&, const Navigate::Goal& goal) {
              const bool is_known = goal.pose.header.frame_id == "map";
              return is_known ? takt::GoalResponse::accept_and_execute : takt::GoalResponse::reject;
            },
            [](const std::shared_ptr<Goal>&) { return takt::CancelResponse::accept; },
            [](std::shared_ptr<Goal> goal) { return drive(std::move(goal)); })) {}

 private:
  // A coroutine: while it sleeps, the node's other callbacks run.
  static takt::Task<> drive(std::shared_ptr<Goal> goal) {
    const double distance = goal->goal().pose.pose.position.x;
    for (double driven = 0; driven < distance; driven += 0.05) {
      if (goal->is_canceling()) {
        goal->canceled({static_cast<float>(driven)});
        co_return;
      }
      goal->publish_feedback({static_cast<float>(distance - driven)});
      co_await takt::sleep_for(std::chrono::milliseconds(50));
    }
    goal->succeed({static_cast<float>(distance)});
  }

  const std::shared_ptr<takt::ActionServer<Navigate>> server_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Navigator, "drives to a pose")
