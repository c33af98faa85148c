// An action client: reaches one goal, cancels another. Beside it runs the server:
//   takt run examples/13_action/navigator.yaml
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/ros2/action_client.hpp"

#include "navigate.hpp"

int main() {
  using namespace std::chrono_literals;
  const auto executor = takt::executors().make("events", {});
  const auto node = std::make_shared<takt::Node>(
      "mission", takt::NodeOptions{.participant = takt::Participant::create({})});
  const auto client = takt::create_action_client<Navigate>(*node, "navigate_to_pose");

  const auto pose = [](const char* frame, double x) {
    Navigate::Goal goal;
    goal.pose.header.frame_id = frame;
    goal.pose.pose.position.x = x;
    return goal;
  };
  int feedbacks = 0;
  const auto count = [&](const auto&, const Navigate::Feedback&) { ++feedbacks; };

  // One coroutine: it asks, and goes on when the answer is there.
  const auto mission = node->create_timer("mission", 100ms, [&]() -> takt::Task<> {
    while (!client->action_server_is_ready()) co_await takt::sleep_for(10ms);

    if (co_await client->send_goal(pose("nowhere", 1)) == nullptr) fmt::print("rejected\n");

    const auto near = co_await client->send_goal(pose("map", 0.2), count);
    const auto reached = co_await client->result(near);
    fmt::print("{} after {:.1f} m, with {}feedback\n", takt::to_string(reached.state),
               reached.result.driven, feedbacks > 1 ? "" : "no ");

    const auto far = co_await client->send_goal(pose("map", 100));
    co_await takt::sleep_for(200ms);
    const auto answer = co_await client->cancel_goal(far);
    const auto end = co_await client->result(far);
    fmt::print("{} of {} on the way, {} goal\n", takt::to_string(end.state),
               end.result.driven < 5 ? "soon" : "late", answer.goals_canceling.size());
    executor->cancel();
  });
  executor->add_node(node);
  executor->spin();
}
