// Actions. Run for every executor under every scheduler.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"

namespace takt::conformance {
namespace {

/// Shaped like nav2_msgs/action/NavigateToPose.
struct Navigate {
  struct Goal {
    double distance = 0;
  };
  struct Result {
    double driven = 0;
  };
  struct Feedback {
    double distance_remaining = 0;
  };
};
TAKT_MESSAGE(Navigate::Goal, "test_msgs/action/Navigate_Goal", distance);
TAKT_MESSAGE(Navigate::Result, "test_msgs/action/Navigate_Result", driven);
TAKT_MESSAGE(Navigate::Feedback, "test_msgs/action/Navigate_Feedback", distance_remaining);

using ServerGoal = std::shared_ptr<ServerGoalHandle<Navigate>>;

class ConformanceAction : public Conformance {
 protected:
  ConformanceAction() {
    server_ = create_action_server<Navigate>(
        *node_, "navigate",
        [](const GoalId&, const Navigate::Goal& goal) {
          return goal.distance > 0 ? GoalResponse::accept_and_execute : GoalResponse::reject;
        },
        [this](const ServerGoal&) { return may_cancel_; },
        [](ServerGoal goal) -> Task<> {
          double driven = 0;
          while (driven < goal->goal().distance) {
            co_await sleep_for(10ms);
            if (goal->is_canceling()) {
              goal->canceled({driven});
              co_return;
            }
            goal->publish_feedback({goal->goal().distance - ++driven});
          }
          goal->succeed({driven});
        },
        {.most_goals = 2, .result_timeout = 1s});
    client_ = create_action_client<Navigate>(*node_, "navigate");
    executor_->add_node(node_);
  }
  void note(std::string what) { trace_.push_back(std::move(what)); }
  void run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      clock_.advance(1ms);
      executor_->spin_all();
    }
  }
  ActionClient<Navigate>::GoalCallbacks noted(const std::string& name) {
    return {.response =
                [this, name](const auto& goal) {
                  note(name + (goal != nullptr ? " accepted" : " rejected"));
                  goal_ = goal;
                },
            .feedback =
                [this, name](const auto&, const Navigate::Feedback& feedback) {
                  note(fmt::format("{} {:.0f} to go", name, feedback.distance_remaining));
                },
            .result =
                [this, name](const auto&, const GoalResult<Navigate>& result) {
                  note(fmt::format("{} {} after {:.0f}", name, to_string(result.state),
                                   result.result.driven));
                }};
  }

  ManualClock clock_{TimePoint{}, virtual_cpus()};
  const std::unique_ptr<Executor> executor_ = make(clock_);
  const std::shared_ptr<Node> node_ = make_node(clock_);
  CancelResponse may_cancel_ = CancelResponse::accept;
  std::shared_ptr<ActionServer<Navigate>> server_;
  std::shared_ptr<ActionClient<Navigate>> client_;
  std::shared_ptr<ClientGoalHandle> goal_;
  std::vector<std::string> trace_;
};

TEST_P(ConformanceAction, AGoalIsReachedWithFeedbackAndResult) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  EXPECT_TRUE(client_->action_server_is_ready());
  client_->async_send_goal({2}, noted("goal"));
  run(5);
  ASSERT_NE(goal_, nullptr);
  EXPECT_EQ(goal_->state(), GoalState::executing);
  run(30);
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal 1 to go", "goal 0 to go",
                                  "goal succeeded after 2"));
}

TEST_P(ConformanceAction, AGoalIsRejected) {
  client_->async_send_goal({0}, noted("goal"));
  run(5);
  EXPECT_THAT(trace_, ElementsAre("goal rejected"));
}

TEST_P(ConformanceAction, AGoalIsCanceledWhenTheServerAgrees) {
  client_->async_send_goal({5}, noted("goal"));
  run(15);
  may_cancel_ = CancelResponse::reject;
  const auto note_code = [this](const action_msgs::srv::CancelGoal::Response& answer) {
    note(fmt::format("code {}, {} goals", answer.return_code, answer.goals_canceling.size()));
  };
  client_->async_cancel_goal(goal_, note_code);
  run(1);
  may_cancel_ = CancelResponse::accept;
  client_->async_cancel_goal(goal_, note_code);
  run(2);
  EXPECT_EQ(goal_->state(), GoalState::canceling);
  run(20);
  client_->async_cancel_goal(goal_, note_code);  // it has ended
  client_->async_cancel_goal(
      std::make_shared<ClientGoalHandle>(new_goal_id(), goal_->stamp(), goal_->client()),
      note_code);
  run(1);
  EXPECT_THAT(trace_,
              ElementsAre("goal accepted", "goal 4 to go", "code 1, 0 goals", "code 0, 1 goals",
                          "goal canceled after 1", "code 3, 0 goals", "code 2, 0 goals"));
}

TEST_P(ConformanceAction, GoalsRunSideBySideAndNoMoreThanFit) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  for (const char* name : {"a", "b", "c"}) client_->async_send_goal({1}, noted(name));
  run(15);
  EXPECT_THAT(trace_, testing::UnorderedElementsAre("a accepted", "b accepted", "c rejected",
                                                    "a 0 to go", "b 0 to go", "a succeeded after 1",
                                                    "b succeeded after 1"));
  trace_.clear();
  client_->async_send_goal({1}, noted("d"));  // those have ended
  run(15);
  EXPECT_THAT(trace_, ElementsAre("d accepted", "d 0 to go", "d succeeded after 1"));
}

// The limit used to be checked when the goal was accepted, in a callback of the library: the Error
// ended spin().
TEST_P(ConformanceAction, AGoalBeyondTheLimitOfTheClientIsRefusedWhenItIsSent) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  const auto client = create_action_client<Navigate>(*node_, "navigate", {.most_goals = 1});
  auto callbacks = noted("a");
  callbacks.result = [&, said = callbacks.result](const auto& goal, const auto& result) {
    said(goal, result);
    client->async_send_goal({1}, noted("b"));  // the place of this one is free
  };
  client->async_send_goal({1}, callbacks);
  run(5);
  try {
    client->async_send_goal({1}, noted("c"));
    ADD_FAILURE() << "the second goal was sent";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("most_goals"));
  }
  run(30);
  EXPECT_THAT(trace_, ElementsAre("a accepted", "a 0 to go", "a succeeded after 1", "b accepted",
                                  "b 0 to go", "b succeeded after 1"));

  client->async_send_goal({0}, noted("d"));  // rejected: takes no place
  run(5);
  client->async_send_goal({1}, {.response = noted("e").response});  // no result wanted: neither
  run(5);
  client->async_get_result(goal_, noted("e").result);
  EXPECT_THROW(client->async_get_result(goal_, noted("e").result), Error);
  client->async_send_goal({1}, noted("f"));
  run(30);
  EXPECT_THAT(trace_, testing::IsSupersetOf({"d rejected", "e accepted", "e succeeded after 1",
                                             "f accepted", "f succeeded after 1"}));
}

TEST_P(ConformanceAction, ACoroutineSendsAGoalAndAwaitsItsResult) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  const auto timer = node_->create_timer("mission", 100ms, [&]() -> Task<> {
    const auto goal = co_await client_->send_goal({2}, [&](const auto&, const auto& feedback) {
      note(fmt::format("{:.0f} to go", feedback.distance_remaining));
    });
    if (goal == nullptr) co_return;
    const auto result = co_await client_->result(goal);
    note(fmt::format("{} after {:.0f}", to_string(result.state), result.result.driven));
    const auto canceled = co_await client_->cancel_goal(goal);
    note(fmt::format("code {}", canceled.return_code));
  });
  run(150);
  EXPECT_THAT(trace_, ElementsAre("1 to go", "0 to go", "succeeded after 2", "code 3"));
}

TEST_P(ConformanceAction, ResultsAreKeptForAWhile) {
  client_->async_send_goal({1}, {.response = [&](const auto& goal) { goal_ = goal; }});
  run(20);
  const auto ask = [&] {
    client_->async_get_result(goal_, [&](const auto&, const GoalResult<Navigate>& result) {
      note(std::string(to_string(result.state)));
    });
    run(2);
  };
  ask();
  clock_.advance(2s);
  run(2);
  ask();
  EXPECT_THAT(trace_, ElementsAre("succeeded", "unknown"));
}

TEST_P(ConformanceAction, NoResultGoesBeforeItsTimeHoweverManyGoalsCome) {
  client_->async_send_goal({1}, {.response = [&](const auto& goal) { goal_ = goal; }});
  run(20);
  const auto first = goal_;
  for (int i = 0; i < 5; ++i) {  // more than fit side by side
    client_->async_send_goal({1}, noted("goal"));
    run(20);
  }
  trace_.clear();
  client_->async_get_result(first, noted("first").result);
  run(2);
  EXPECT_THAT(trace_, ElementsAre("first succeeded after 1"));
}

TEST_P(ConformanceAction, AGoalIsRejectedRatherThanAResultForgotten) {
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  const auto server = create_action_server<Navigate>(
      *node_, "brief", [](const auto&, const auto&) { return GoalResponse::accept_and_execute; },
      [](const ServerGoal&) { return CancelResponse::accept; },
      [](const ServerGoal& goal) { goal->succeed({1}); },
      {.result_timeout = 1s, .most_results = 1});
  const auto client = create_action_client<Navigate>(*node_, "brief");
  for (const char* name : {"a", "b"}) {
    client->async_send_goal({1}, noted(name));
    run(5);
  }
  clock_.advance(1s);
  run(5);
  client->async_send_goal({1}, noted("c"));
  run(5);
  EXPECT_THAT(trace_, ElementsAre("a accepted", "a succeeded after 1", "b rejected", "c accepted",
                                  "c succeeded after 1"));
}

TEST_P(ConformanceAction, ADeferredGoalIsExecutedWhenItsServerSaysSo) {
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  ServerGoal held;
  const auto server = create_action_server<Navigate>(
      *node_, "patient", [](const auto&, const auto&) { return GoalResponse::accept_and_defer; },
      [](const ServerGoal&) { return CancelResponse::accept; },
      [&](const ServerGoal& goal) { held = goal; });
  const auto client = create_action_client<Navigate>(*node_, "patient");
  client->async_send_goal({1}, noted("goal"));
  run(5);
  ASSERT_NE(held, nullptr);
  EXPECT_EQ(held->state(), GoalState::accepted);
  EXPECT_EQ(goal_->state(), GoalState::accepted);
  EXPECT_THROW(held->succeed({}), Error);
  held->execute();
  EXPECT_EQ(held->state(), GoalState::executing);
  EXPECT_THROW(held->execute(), Error);
  held->succeed({1});
  EXPECT_THROW(held->execute(), Error);
  run(5);
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal succeeded after 1"));
}

// As in ROS 2, a cancellation is a wish: the goal may be reached, or fail, before it ends.
TEST_P(ConformanceAction, AGoalThatIsBeingCanceledMaySucceedOrAbort) {
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  std::vector<ServerGoal> held;
  const auto server = create_action_server<Navigate>(
      *node_, "stubborn", [](const auto&, const auto&) { return GoalResponse::accept_and_execute; },
      [](const ServerGoal&) { return CancelResponse::accept; },
      [&](const ServerGoal& goal) { held.push_back(goal); });
  const auto client = create_action_client<Navigate>(*node_, "stubborn");
  for (const char* name : {"a", "b"}) {
    client->async_send_goal({1}, noted(name));
    run(5);
    client->async_cancel_goal(goal_, {});
    run(5);
  }
  ASSERT_EQ(held.size(), 2u);
  for (const ServerGoal& goal : held) EXPECT_EQ(goal->state(), GoalState::canceling);
  held[0]->succeed({1});
  held[1]->abort({2});
  run(5);
  EXPECT_THAT(trace_,
              ElementsAre("a accepted", "b accepted", "a succeeded after 1", "b aborted after 2"));
}

TEST_P(ConformanceAction, AGoalThatNobodyEndsIsAborted) {
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  const auto other = create_action_server<Navigate>(
      *node_, "forgetful",
      [](const auto&, const auto&) { return GoalResponse::accept_and_execute; },
      [](const ServerGoal&) { return CancelResponse::accept; }, [](const ServerGoal&) {});
  const auto client = create_action_client<Navigate>(*node_, "forgetful");
  client->async_send_goal({1}, noted("goal"));
  run(5);
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal aborted after 0"));
}

// The user's function was copied for each message.
TEST_P(ConformanceAction, FeedbackAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  ServerGoal held;
  std::atomic<bool> is_accepted{false}, is_held{false};
  std::atomic<int> received{0};
  const auto server = create_action_server<Navigate>(
      *node, "patient", [](const auto&, const auto&) { return GoalResponse::accept_and_execute; },
      [](const ServerGoal&) { return CancelResponse::accept; },
      [&](const ServerGoal& goal) {
        held = goal;
        is_held = true;
      });
  const auto client = create_action_client<Navigate>(*node, "patient");
  const std::array<long, 5> captured{};
  std::shared_ptr<ClientGoalHandle> goal;
  client->async_send_goal({1}, {.response =
                                    [&](const auto& accepted) {
                                      goal = accepted;
                                      is_accepted = true;
                                    },
                                .feedback =
                                    [&received, captured](const auto&, const auto&) {
                                      received += 1 + static_cast<int>(captured[0]);
                                    }});
  executor->add_node(node);
  const auto feed = [&] {
    SpinThread spin(*executor);
    EXPECT_TRUE(eventually([&] { return is_accepted && is_held; }));
    for (int fed = 0; fed < 20; ++fed) {
      const int before = received;
      held->publish_feedback({1});
      EXPECT_TRUE(eventually([&] { return received != before; }));
    }
  };
  feed();  // the goal allocates
  feed();
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    EXPECT_EQ(thread.counters.allocations, 0u) << thread.asked.name;
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceAction);

}  // namespace
}  // namespace takt::conformance
