// Goals, from both ends, without an executor.
// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action_client.hpp"

#include <future>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/messages/entries.hpp"
#include "takt/ros2/action_server.hpp"
#include "takt/testing/serve.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

struct Drive {
  struct Goal {
    int distance = 0;
  };
  struct Result {
    int driven = 0;
  };
  struct Feedback {
    int driven = 0;
  };
};
TAKT_MESSAGE(Drive::Goal, "test_msgs/action/Drive_Goal", distance);
TAKT_MESSAGE(Drive::Result, "test_msgs/action/Drive_Result", driven);
TAKT_MESSAGE(Drive::Feedback, "test_msgs/action/Drive_Feedback", driven);

using ServerGoal = std::shared_ptr<ServerGoalHandle<Drive>>;
using Server = ActionServer<Drive>;
using DriveClient = ActionClient<Drive>;

GoalResponse accept(const GoalId&, const Drive::Goal&) {
  return GoalResponse::accept_and_execute;
}
CancelResponse accept_cancel(const ServerGoal&) {
  return CancelResponse::accept;
}

class ActionClientTest : public testing::Test {
 protected:
  void note(std::string what) { trace_.push_back(std::move(what)); }
  DriveClient::GoalCallbacks noted(const std::string& name) {
    return {.response =
                [this, name](const auto& goal) {
                  note(name + (goal != nullptr ? " accepted" : " rejected"));
                  goal_ = goal;
                },
            .result =
                [this, name](const auto&, const GoalResult<Drive>& result) {
                  note(fmt::format("{} {}", name, to_string(result.state)));
                  error_ = result.error;
                }};
  }
  // One that keeps the goals that it gets.
  std::shared_ptr<Server> make_server() {
    return create_action_server<Drive>(*server_node_, "drive", accept, accept_cancel,
                                       [this](ServerGoal goal) { held_.push_back(goal); });
  }
  bool serve_all() {
    bool has_served = false;
    for (const auto& node : {node_, server_node_}) {
      for (const auto& entity : node->entities()) {
        try {
          while (serve(*entity)) has_served = true;
        } catch (const std::runtime_error& error) {
          has_served = true;
          note(error.what());
        }
      }
    }
    return has_served;
  }
  void run(Nanoseconds duration = 0ms) {
    clock_.advance(duration);
    while (serve_all()) {
    }
  }

  ManualClock clock_;
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  const std::shared_ptr<Node> server_node_ =
      std::make_shared<Node>("server", NodeOptions{.clock = &clock_});
  std::vector<ServerGoal> held_;
  std::shared_ptr<ClientGoalHandle> goal_;
  std::string error_;
  std::vector<std::string> trace_;
};

/// Part of a user's function: when it goes, another thread must get on.
struct Probe {
  explicit Probe(std::function<void()> other) : act(std::move(other)) {}
  ~Probe() {
    auto done = std::async(std::launch::async, act);
    got_on = done.wait_for(10s) == std::future_status::ready;
  }
  static inline bool got_on = false;
  std::function<void()> act;
};

// The wrong server did not know it, which became the state of the goal.
TEST_F(ActionClientTest, RefusesAGoalOfAnotherClient) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  const auto other = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({}, noted("goal"));
  run();
  ASSERT_NE(goal_, nullptr);
  const auto refuses = [](auto&& call) {
    EXPECT_THAT(
        call, testing::ThrowsMessage<Error>(HasSubstr("is none of this client of action 'drive'")));
  };
  refuses([&] { other->async_get_result(goal_, {}); });
  refuses([&] { other->async_cancel_goal(goal_, {}); });
  run();
  EXPECT_NE(goal_->state(), GoalState::unknown);
}

// In a reentrant group feedback was called during the callback of the response, and the result
// during that of feedback.
TEST_F(ActionClientTest, CallbacksOfAGoalAreCalledOneAtATimeInTheirOrder) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(
      *node_, "drive",
      {.group = node_->create_callback_group("reentrant", CallbackGroupType::Reentrant)});
  // Of the entities, what has come is served, by another thread of the pool.
  const auto serve_others = [&](const std::string& in) {
    note(in + " begins");
    std::thread([this] { run(); }).join();
    note(in + " ends");
  };
  DriveClient::GoalCallbacks callbacks;
  callbacks.response = [&](const auto&) {
    while (serve_all() && held_.empty()) {
    }
    ASSERT_FALSE(held_.empty());
    // The subscription has room for ten of them.
    for (int i = 1; i <= 12; ++i) held_[0]->publish_feedback({i});
    serve_others("response");
  };
  callbacks.feedback = [&](const auto&, const Drive::Feedback& feedback) {
    if (feedback.driven != 3) return note(fmt::format("feedback {}", feedback.driven));
    held_[0]->publish_feedback({13});
    held_[0]->succeed({20});
    serve_others("feedback 3");
  };
  callbacks.result = [&](const auto&, const GoalResult<Drive>& result) {
    note(fmt::format("result {}", result.result.driven));
  };
  callbacks.result_came = [&](const auto&, const auto&) { note("came"); };
  client->async_send_goal({}, callbacks);
  run();
  EXPECT_THAT(trace_, ElementsAre("response begins", "response ends", "feedback 3 begins", "came",
                                  "feedback 3 ends", "feedback 4", "feedback 5", "feedback 6",
                                  "feedback 7", "feedback 8", "feedback 9", "feedback 10",
                                  "feedback 11", "feedback 12", "feedback 13", "result 20"));
}

// It went with the mutex held that every feedback message and status needs: a pool hung.
TEST_F(ActionClientTest, AFeedbackFunctionGoesWithoutALock) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  const auto status = node_->find_entity("drive/_action/status");
  const auto send = [&](DriveClient::GoalCallbacks callbacks) {
    auto probe = std::make_shared<Probe>([=] { serve(*status); });
    callbacks.feedback = [probe = std::move(probe)](const auto&, const auto&) {};
    client->async_send_goal({1}, std::move(callbacks));
    run();
  };
  send(noted("goal"));
  held_.back()->succeed({});
  Probe::got_on = false;
  run();
  EXPECT_TRUE(Probe::got_on) << "at its result";

  send({});  // nobody keeps this goal, so the next one replaces it
  Probe::got_on = false;
  send(noted("next"));
  EXPECT_TRUE(Probe::got_on) << "when its goal was dropped";
  held_.clear();
  run();
}

// The result was never asked for then.
TEST_F(ActionClientTest, AnExceptionAboutTheResponseDoesNotLoseTheResult) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  auto callbacks = noted("goal");
  callbacks.response = [](const auto&) { throw std::runtime_error("log file full"); };
  client->async_send_goal({1}, callbacks);
  run();
  held_.at(0)->succeed({1});
  run();
  EXPECT_THAT(trace_, ElementsAre("log file full", "goal succeeded"));
}

// ---- Handlers that fail ----

// There was no answer then, so the client waited for ever.
TEST_F(ActionClientTest, AHandlerThatThrowsRejectsOrAborts) {
  const auto server = create_action_server<Drive>(
      *server_node_, "drive",
      [](const GoalId&, const Drive::Goal& goal) {
        if (goal.distance == 1) throw std::runtime_error("handle_goal fails");
        return GoalResponse::accept_and_execute;
      },
      [](const ServerGoal&) -> CancelResponse { throw std::runtime_error("handle_cancel fails"); },
      [this](ServerGoal goal) {
        if (goal->goal().distance == 2) throw std::runtime_error("handle_accepted fails");
        held_.push_back(goal);
      });
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, noted("one"));
  run();
  EXPECT_THAT(trace_, ElementsAre("handle_goal fails", "one rejected"));
  trace_.clear();
  client->async_send_goal({2}, noted("two"));
  run();
  EXPECT_THAT(trace_, testing::UnorderedElementsAre("two accepted", "handle_accepted fails",
                                                    "two aborted"));
  trace_.clear();
  client->async_send_goal({3}, noted("three"));
  run();
  client->async_cancel_goal(
      goal_, [&](const auto& answer) { note(fmt::format("code {}", answer.return_code)); });
  run();
  EXPECT_THAT(trace_, ElementsAre("three accepted", "handle_cancel fails", "code 1"));
  EXPECT_EQ(held_.at(0)->state(), GoalState::executing);
}

// ---- Coroutines that go on ----

// It was accepted then, and aborted at once: goals and coroutines had each a counter.
TEST_F(ActionClientTest, AGoalIsExecutedWhenACoroutineOfAnEarlierOneHasEnded) {
  const auto server =
      create_action_server<Drive>(*server_node_, "drive", accept, accept_cancel,
                                  [this](ServerGoal goal) -> Task<> {
                                    note(fmt::format("{} begins", goal->goal().distance));
                                    goal->succeed({});
                                    goal.reset();
                                    co_await sleep_for(100ms);
                                    note("cleaned up");
                                  },
                                  {.most_goals = 1});
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, noted("one"));
  run();
  client->async_send_goal({2}, noted("two"));
  run(50ms);
  EXPECT_THAT(trace_, testing::UnorderedElementsAre("1 begins", "one accepted", "one succeeded",
                                                    "two accepted"));
  EXPECT_EQ(goal_->state(), GoalState::accepted);
  client->async_send_goal({3}, noted("three"));  // two has the place
  run(10ms);
  EXPECT_EQ(trace_.back(), "three rejected");
  trace_.clear();
  run(40ms);
  EXPECT_THAT(trace_, ElementsAre("cleaned up", "2 begins", "two succeeded"));
}

// ---- Servers that go ----

// It waited for ever then, though the client knew that the server was gone.
TEST_F(ActionClientTest, AGoalIsAbortedWhenItsServerIsDropped) {
  auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, noted("goal"));
  run();
  server.reset();
  run();
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal aborted"));
  EXPECT_FALSE(held_.at(0)->is_active());
  held_.at(0)->succeed({});  // its client has the result
}

// It was dereferenced: a client whose goal was refused crashed when it asked for the result.
TEST_F(ActionClientTest, AGoalThatWasNotAcceptedHasNoResult) {
  const auto client = create_action_client<Drive>(*node_, "drive");
  EXPECT_THROW(client->async_get_result(nullptr, noted("goal").result), Error);
  EXPECT_THROW(client->async_cancel_goal(nullptr, {}), Error);
}

TEST_F(ActionClientTest, WhatNoServerCanAnswerEndsAfterTwoSeconds) {
  auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, {.response = noted("goal").response});
  run();
  server.reset();
  client->async_get_result(goal_, noted("goal").result);
  client->async_send_goal({1}, noted("next"));
  client->async_cancel_goal(goal_, [&](const auto& answer) {
    note(fmt::format("{} goals canceled", answer.goals_canceling.size()));
  });
  run(1999ms);
  EXPECT_THAT(trace_, ElementsAre("goal accepted"));
  run(1ms);
  EXPECT_THAT(trace_, testing::UnorderedElementsAre("goal accepted", "goal unknown",
                                                    "next rejected", "0 goals canceled"));
  EXPECT_THAT(error_, HasSubstr("no answer"));
  EXPECT_THAT(error_, HasSubstr("/drive/_action/get_result"));
}

TEST_F(ActionClientTest, AServerThatIsRestartedDoesNotInheritGoals) {
  auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, {.response = noted("goal").response});
  run();
  server.reset();
  client->async_get_result(goal_, noted("goal").result);
  run(1s);
  server = make_server();
  run();
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal unknown"));
  EXPECT_THAT(error_, HasSubstr("restarted"));
}

// Another server that comes or goes, as discovery may see them, ends no goal of this one.
TEST_F(ActionClientTest, AGoalStaysWithItsServerWhateverComesAndGoes) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, noted("goal"));
  run();
  // The ends of requests alone: they answer nothing.
  const auto requests = node_->create_service<GetResult<Drive>>("drive/_action/get_result",
                                                                [](const auto&, RequestId) {});
  run();
  held_.at(0)->succeed({});
  run(3s);
  EXPECT_THAT(trace_, ElementsAre("goal accepted", "goal succeeded"));
}

TEST_F(ActionClientTest, AGoalWaitsOnAsInRos2IfOneSaysSo) {
  auto server = make_server();
  const auto client =
      create_action_client<Drive>(*node_, "drive", {.without_server = Nanoseconds::max()});
  client->async_send_goal({1}, {.response = noted("goal").response});
  run();
  server.reset();
  client->async_get_result(goal_, noted("goal").result);
  run(1h);
  EXPECT_THAT(trace_, ElementsAre("goal accepted"));
}

TEST_F(ActionClientTest, ACoroutineLearnsThatItsServerHasGone) {
  auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  const auto timer = node_->create_timer("mission", 10ms, [&]() -> Task<> {
    const auto goal = co_await client->send_goal({1});
    const auto result = co_await client->result(goal);
    note(std::string(to_string(result.state)));
  });
  run(10ms);
  ASSERT_EQ(held_.size(), 1u);
  held_.clear();
  server.reset();
  timer->cancel();
  run();
  EXPECT_THAT(trace_, ElementsAre("aborted"));
}

TEST_F(ActionClientTest, ListsOfStatesThatAreTooLongAreNotRead) {
  const auto server = make_server();
  const auto client = create_action_client<Drive>(*node_, "drive");
  client->async_send_goal({1}, noted("goal"));
  run();
  ASSERT_NE(goal_, nullptr);
  const auto stranger = server_node_->create_publisher<action_msgs::msg::GoalStatusArray>(
      "drive/_action/status", QoS(1).transient_local());
  const auto say = [&](std::size_t states, GoalState state) {
    action_msgs::msg::GoalStatusArray message;
    message.status_list.resize(states);
    message.status_list.back().goal_info.goal_id = goal_->id();
    message.status_list.back().status = static_cast<std::int8_t>(state);
    stranger->publish(message);
    run();
    return goal_->state();
  };
  EXPECT_EQ(say(kMostEntries, GoalState::canceling), GoalState::canceling);
  EXPECT_EQ(say(kMostEntries + 1, GoalState::executing), GoalState::canceling);
}

}  // namespace
}  // namespace takt
