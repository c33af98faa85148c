// What a program may drop or throw while callbacks run. Run for every executor under every
// scheduler.
// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"
#include "takt/testing/outside.hpp"

// Its services and actions have the names of other tests'.
namespace takt::conformance::lifetime {
namespace {

struct Double {
  struct Request {
    int value = 0;
  };
  struct Response {
    int value = 0;
  };
};
TAKT_MESSAGE(Double::Request, "test/srv/Double_Request", value);
TAKT_MESSAGE(Double::Response, "test/srv/Double_Response", value);

struct Count {
  struct Goal {
    int to = 0;
  };
  struct Result {
    int counted = 0;
  };
  struct Feedback {
    int now = 0;
  };
};
TAKT_MESSAGE(Count::Goal, "test_msgs/action/Count_Goal", to);
TAKT_MESSAGE(Count::Result, "test_msgs/action/Count_Result", counted);
TAKT_MESSAGE(Count::Feedback, "test_msgs/action/Count_Feedback", now);

using ServerGoal = std::shared_ptr<ServerGoalHandle<Count>>;
using Client = ActionClient<Count>;

GoalResponse accept_goal(const GoalId&, const Count::Goal&) {
  return GoalResponse::accept_and_execute;
}
CancelResponse accept_cancel(const ServerGoal&) {
  return CancelResponse::accept;
}

class ConformanceLifetime : public Conformance {
 protected:
  void note(std::string what) { trace_.push_back(std::move(what)); }
  void run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      clock_.advance(1ms);
      try {
        executor_->spin_all();
      } catch (const std::runtime_error& error) {
        note(error.what());
      }
    }
  }
  Client::GoalCallbacks noted(const std::string& name) {
    return {.response =
                [this, name](const auto& goal) {
                  note(name + (goal != nullptr ? " accepted" : " rejected"));
                },
            .result =
                [this, name](const auto&, const GoalResult<Count>& result) {
                  note(fmt::format("{} {}", name, to_string(result.state)));
                }};
  }

  ManualClock clock_{TimePoint{}, virtual_cpus()};
  const std::unique_ptr<Executor> executor_ = make(clock_);
  const std::shared_ptr<Node> node_ = make_node(clock_);
  std::vector<std::string> trace_;
};

// ---- Clients ----

TEST_P(ConformanceLifetime, AClientThatItsCallbackDropsIsSilent) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  const auto service = node_->create_service<Double>(
      "twice", [](const auto& request, auto& response) { response.value = 2 * request.value; });
  auto client = node_->create_client<Double>("twice", {.timeout = 1s});
  executor_->add_node(node_);
  for (int call = 0; call < 3; ++call) {
    client->async_send_request({call}, [&](const Double::Response* answer) {
      note(answer != nullptr ? std::to_string(answer->value) : "none");
      client.reset();
    });
  }
  run(1);
  clock_.advance(2s);
  run(1);
  EXPECT_THAT(trace_, ElementsAre("0"));
}

TEST_P(ConformanceLifetime, AClientThatIsDroppedWhenACallEndsWithoutAnswerIsSilent) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  auto client = node_->create_client<Double>("nobody", {.timeout = 5ms});
  executor_->add_node(node_);
  for (int call = 0; call < 3; ++call) {
    client->async_send_request({call}, [&](const Double::Response*) {
      note("none");
      client.reset();
    });
  }
  run(20);
  EXPECT_THAT(trace_, ElementsAre("none"));
}

TEST_P(ConformanceLifetime, AnExceptionWhenACallEndsWithoutAnswerHoldsUpNoOtherCall) {
  const auto client = node_->create_client<Double>("nobody", {.timeout = 5ms});
  executor_->add_node(node_);
  for (int call = 0; call < 3; ++call) {
    client->async_send_request({call}, [&, call](const Double::Response*) {
      if (call == 0) throw std::runtime_error("broken");
      note(std::to_string(call));
    });
  }
  run(7);
  EXPECT_THAT(trace_, ElementsAre("broken", "1", "2"));
  EXPECT_EQ(client->calls_in_flight(), 0u);
}

TEST_P(ConformanceLifetime, ClientsComeWhileTheExecutorSpinsHoweverShortTheirTimeout) {
  if (is_frozen()) GTEST_SKIP() << "a static executor takes nothing more";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  executor->add_node(node);
  const SpinThread spin(*executor);
  for (int i = 0; i < 100; ++i) {
    const auto client = node->create_client<Double>("nobody", {.timeout = 1ns});
    const auto future = client->async_send_request({i});
    EXPECT_TRUE(eventually([&] { return future.ready(); }));
  }
}

TEST_P(ConformanceLifetime, ACoroutineWhoseClientGoesGetsNoAnswer) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  auto client = node_->create_client<Double>("nobody");
  const auto timer = node_->create_timer("ask", 1h, [&]() -> Task<> {
    const Double::Request request{1};
    const auto answer = co_await client->call(request);
    note(answer ? "answer" : "none");
  });
  executor_->add_node(node_);
  timer->release_at(clock_.now());
  run(1);
  client.reset();
  run(1);
  EXPECT_THAT(trace_, ElementsAre("none"));
}

// Any process of the network can send a reply.
TEST_P(ConformanceLifetime, AReplyThatNobodyHasAskedForChangesNothing) {
  std::shared_ptr<Service<Double>> service;
  service = node_->create_service<Double>("twice", [&](const auto& request, RequestId id) {
    for (const std::int64_t sequence : {std::int64_t{0}, std::int64_t{-1}, id.sequence + 1,
                                        std::numeric_limits<std::int64_t>::max()}) {
      service->send_response({id.client, sequence}, {-1});
    }
    for (int i = 0; i < 2; ++i) service->send_response(id, {2 * request.value});
    service->send_response({id.client, 0}, {-1});
  });
  const auto client = node_->create_client<Double>("twice");
  executor_->add_node(node_);
  client->async_send_request({21},
                             [&](const auto* answer) { note(std::to_string(answer->value)); });
  EXPECT_NO_THROW(executor_->spin_all());
  client->async_send_request({4}, {});  // nobody wants to know
  EXPECT_NO_THROW(executor_->spin_all());
  EXPECT_THAT(trace_, ElementsAre("42"));
}

TEST_P(ConformanceLifetime, AServiceThatAnotherThreadDropsAnswersFirst) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  const auto outside = std::make_shared<Outside>();
  const auto executor = make(Clock::steady());
  const auto node = std::make_shared<Node>("node", NodeOptions{.participant = outside});
  const SubscriptionBase* asked = nullptr;
  auto service =
      node->create_service<Double>("twice", [&asked](const auto& request, auto& response) {
        response.value = 2 * request.value;
        asked->outside_publisher_count();  // takes its time, see Outside
      });
  asked = service.get();
  const auto caller = make_node(Clock::steady(), "caller");
  const auto client = caller->create_client<Double>("twice");
  executor->add_node(node);
  const SpinThread spin(*executor);
  client->async_send_request({1}, {});
  EXPECT_TRUE(eventually([&] { return outside->is_asked.load(); }));
  service.reset();
  EXPECT_TRUE(outside->is_gone);
  EXPECT_FALSE(outside->went_inside);
  EXPECT_EQ(client->ready_count(), 1u);
}

// ---- Action clients ----

TEST_P(ConformanceLifetime, AnActionClientThatItsResponseDropsIsSilent) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  const auto server = create_action_server<Count>(*node_, "count", accept_goal, accept_cancel,
                                                  [](ServerGoal goal) { goal->succeed({1}); });
  auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  auto callbacks = noted("goal");
  callbacks.response = [&](const auto&) {
    note("dropped");
    client.reset();
  };
  client->async_send_goal({1}, std::move(callbacks));
  run(5);
  EXPECT_THAT(trace_, ElementsAre("dropped"));
}

TEST_P(ConformanceLifetime, CoroutinesWhoseActionClientGoesGetNothing) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  std::vector<ServerGoal> kept;
  const auto server =
      create_action_server<Count>(*node_, "count", accept_goal, accept_cancel,
                                  [&](ServerGoal goal) { kept.push_back(std::move(goal)); });
  auto client = create_action_client<Count>(*node_, "count");
  const auto timer = node_->create_timer("mission", 1h, [&]() -> Task<> {
    const auto goal = co_await client->send_goal({1});
    if (goal == nullptr) co_return;
    note("accepted");
    const auto result = co_await client->result(goal);
    note(std::string(to_string(result.state)));
  });
  executor_->add_node(node_);
  timer->release_at(clock_.now());
  run(5);
  EXPECT_THAT(trace_, ElementsAre("accepted"));
  client.reset();
  run(2);
  EXPECT_THAT(trace_, ElementsAre("accepted", "unknown"));
}

TEST_P(ConformanceLifetime, AResultThatNobodyWantsIsNoError) {
  const auto server = create_action_server<Count>(*node_, "count", accept_goal, accept_cancel,
                                                  [](ServerGoal goal) { goal->succeed({1}); });
  const auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  client->async_send_goal({1}, {.response = [&](const auto& goal) {
                            note("accepted");
                            client->async_get_result(goal, {});
                          }});
  run(5);
  EXPECT_THAT(trace_, ElementsAre("accepted"));
}

// ---- Action servers ----

TEST_P(ConformanceLifetime, AnExceptionInHandleAcceptedHoldsUpNoOtherGoal) {
  const auto server =
      create_action_server<Count>(*node_, "count", accept_goal, accept_cancel, [](ServerGoal goal) {
        if (goal->goal().to == 0) throw std::runtime_error("broken");
        goal->succeed({goal->goal().to});
      });
  const auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  for (int to : {0, 1, 2}) client->async_send_goal({to}, noted(std::to_string(to)));
  run(5);
  EXPECT_THAT(trace_, UnorderedElementsAre("0 accepted", "1 accepted", "2 accepted", "broken",
                                           "0 aborted", "1 succeeded", "2 succeeded"));
}

TEST_P(ConformanceLifetime, AnActionServerThatHandleGoalDropsAcceptsNothing) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  std::shared_ptr<ActionServer<Count>> server;
  server = create_action_server<Count>(
      *node_, "count",
      [&](const auto&, const auto&) {
        server.reset();
        return GoalResponse::accept_and_execute;
      },
      accept_cancel, [&](const ServerGoal&) { note("handled"); });
  const auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  client->async_send_goal({1}, noted("goal"));
  run(5);
  EXPECT_THAT(trace_, ElementsAre("goal rejected"));
}

TEST_P(ConformanceLifetime, AnActionServerMayGoInHandleAccepted) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  std::shared_ptr<ActionServer<Count>> server;
  server = create_action_server<Count>(*node_, "count", accept_goal, accept_cancel,
                                       [&](const ServerGoal&) {
                                         note("handled");
                                         server.reset();
                                       });
  const auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  for (int i = 0; i < 3; ++i) client->async_send_goal({1});
  run(5);
  EXPECT_THAT(trace_, ElementsAre("handled"));
}

TEST_P(ConformanceLifetime, AnActionServerMayGoInACoroutineThatReachesAGoal) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  for (const bool waits_before : {false, true}) {
    std::shared_ptr<ActionServer<Count>> server;
    server = create_action_server<Count>(*node_, "count", accept_goal, accept_cancel,
                                         [&](ServerGoal) -> Task<> {
                                           if (waits_before) co_await sleep_for(1ms);
                                           server.reset();
                                           note("goes on to its next await");
                                           co_await sleep_for(1ms);
                                           note("and no further");
                                         });
    const auto client = create_action_client<Count>(*node_, "count");
    if (!waits_before) executor_->add_node(node_);
    client->async_send_goal({1});
    run(5);
    EXPECT_THAT(trace_, ElementsAre("goes on to its next await"));
    trace_.clear();
  }
}

TEST_P(ConformanceLifetime, AnActionServerMayGoInHandleCancel) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  std::shared_ptr<ActionServer<Count>> server;
  std::vector<ServerGoal> kept;
  server = create_action_server<Count>(
      *node_, "count", accept_goal,
      [&](const ServerGoal&) {
        server.reset();
        return CancelResponse::accept;
      },
      [&](ServerGoal goal) { kept.push_back(std::move(goal)); });
  const auto client = create_action_client<Count>(*node_, "count");
  executor_->add_node(node_);
  client->async_send_goal({1});
  run(3);
  ASSERT_EQ(kept.size(), 1u);
  client->async_cancel_all_goals([](const auto&) {});
  run(3);
  EXPECT_EQ(kept[0]->state(), GoalState::aborted);
  kept[0]->canceled({});  // its client has the result
}

// ---- Coroutines ----

TEST_P(ConformanceLifetime, ATimerGoesOnAfterItsLambdaHasThrownInsteadOfReturningATask) {
  const auto counts = [this]() -> Task<> {
    note("runs");
    co_return;
  };
  bool throws = true;
  const auto timer = node_->create_timer("tick", 2ms, [&]() -> Task<> {
    if (std::exchange(throws, false)) throw std::runtime_error("broken");
    return counts();
  });
  executor_->add_node(node_);
  run(6);
  EXPECT_THAT(trace_, ElementsAre("broken", "runs", "runs"));
  EXPECT_EQ(timer->missed(), 0u);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceLifetime);

}  // namespace
}  // namespace takt::conformance::lifetime
