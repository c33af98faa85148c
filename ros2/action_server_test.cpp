// What an action server's goals and requests do to each other, without an executor.
// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action_server.hpp"

#include <cstring>
#include <thread>

#include <gtest/gtest.h>

namespace takt {
namespace {

struct Nothing {
  struct Goal {
    int number = 0;
  };
  struct Result {
    int number = 0;
  };
  struct Feedback {
    int number = 0;
  };
};
TAKT_MESSAGE(Nothing::Goal, "test_msgs/action/Nothing_Goal", number);
TAKT_MESSAGE(Nothing::Result, "test_msgs/action/Nothing_Result", number);
TAKT_MESSAGE(Nothing::Feedback, "test_msgs/action/Nothing_Feedback", number);

GoalId goal_id(std::uint64_t number) {
  GoalId id;
  std::memcpy(id.uuid.data(), &number, sizeof number);
  return id;
}

// It held its mutex then, and the goal's destructor waited for that.
TEST(ActionServerCore, ARequestToCancelMayHoldTheLastPointerToAnotherGoal) {
  const auto node = std::make_shared<Node>("node");
  constexpr std::size_t kGoals = 50;
  const auto core = std::make_shared<ActionServerCore<Nothing>>(
      "nothing", ActionServerOptions{.most_goals = kGoals, .result_timeout = Nanoseconds::zero()});
  const auto expiry = node->create_timer("expiry", std::chrono::hours(1), [] {});
  core->set_expiry(expiry);
  core->set_publishers(node->create_publisher<FeedbackMessage<Nothing>>("feedback", 1),
                       node->create_publisher<action_msgs::msg::GoalStatusArray>("status", 1));
  std::atomic<bool> is_over{false};
  std::thread canceling([&] {
    const auto never = [](const auto&) { return CancelResponse::reject; };
    while (!is_over.load())
      core->cancel(action_msgs::msg::GoalInfo().set__goal_id(goal_id(1)), never);
  });
  std::uint64_t number = 1;
  for (int round = 0; round < 400; ++round) {
    std::vector<std::shared_ptr<ServerGoalHandle<Nothing>>> goals;
    while (goals.size() < kGoals) {
      goals.push_back(core->accept(goal_id(++number), {}, {}));
      ASSERT_NE(goals.back(), nullptr);
      core->begin(goals.back()->id());
      goals.back()->succeed({});
    }
    core->expire();
  }
  is_over.store(true);
  canceling.join();
}

TEST(ActionServerCore, AGoalIsAcceptedAndExecutedOnce) {
  const auto node = std::make_shared<Node>("node");
  const auto core =
      std::make_shared<ActionServerCore<Nothing>>("nothing", ActionServerOptions{.most_goals = 2});
  core->set_publishers(node->create_publisher<FeedbackMessage<Nothing>>("feedback", 1),
                       node->create_publisher<action_msgs::msg::GoalStatusArray>("status", 1));
  const auto goal = core->accept(goal_id(1), {}, {});
  EXPECT_EQ(core->accept(goal_id(1), {}, {}), nullptr);
  goal->execute();
  EXPECT_THROW(goal->execute(), Error);
  EXPECT_TRUE(goal->is_active());
}

}  // namespace
}  // namespace takt
