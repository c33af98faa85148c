// ROS 2's graph: what processes publish about their nodes, and its bytes on the wire.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/entries.hpp"
#include "takt/messages/example_interfaces/action/fibonacci.hpp"
#include "takt/messages/rmw_dds_common/msg/participant_entities_info.hpp"
#include "takt/messages/std_msgs/msg/bool.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/testing/serve.hpp"

namespace takt::graph_test {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

struct Add {
  struct Request {
    std::int64_t a = 0, b = 0;
  };
  struct Response {
    std::int64_t sum = 0;
  };
};
TAKT_MESSAGE(Add::Request, "example_interfaces/srv/AddTwoInts_Request", a, b);
TAKT_MESSAGE(Add::Response, "example_interfaces/srv/AddTwoInts_Response", sum);

struct Count {
  struct Goal {
    std::int32_t to = 0;
  };
  struct Result {
    std::int32_t reached = 0;
  };
  struct Feedback {
    std::int32_t now = 0;
  };
};
TAKT_MESSAGE(Count::Goal, "test_msgs/action/Count_Goal", to);
TAKT_MESSAGE(Count::Result, "test_msgs/action/Count_Result", reached);
TAKT_MESSAGE(Count::Feedback, "test_msgs/action/Count_Feedback", now);

auto is(const std::string& name, const std::string& type, const std::string& node) {
  return testing::AllOf(Field("name", &GraphEndpoint::name, name),
                        Field("type", &GraphEndpoint::type, type),
                        Field("node", &GraphEndpoint::node, node));
}

class GraphTest : public testing::TestWithParam<RosGraph> {
 protected:
  std::shared_ptr<Participant> join(RosGraph form) const {
    DdsOptions options;
    options.domain = test_domain();
    options.shared_memory = SharedMemory::off;
    options.ros_graph = form;
    return Participant::create(options);
  }
  const std::shared_ptr<Participant> here_ = join(GetParam());
  const std::shared_ptr<Participant> there_ = join(GetParam());
};

TEST_P(GraphTest, ShowsNodesTopicsServicesAndTheirOwners) {
  auto node =
      std::make_shared<Node>("talker", NodeOptions{.name_space = "/front", .participant = here_});
  const auto publisher =
      node->create_publisher<std_msgs::msg::String>("chatter", QoS(7).best_effort());
  const auto subscription =
      node->create_subscription<std_msgs::msg::Bool>("/enable", 3, [](const auto&) {});
  const auto service = node->create_service<Add>("~/add", [](const auto&, auto&) {});
  const auto client = node->create_client<Add>("/other/add");
  Graph graph;
  ASSERT_TRUE(eventually([&] {
    graph = there_->graph();
    return !graph.nodes.empty() && !graph.publishers.empty() && !graph.subscriptions.empty() &&
           !graph.services.empty() && !graph.clients.empty() &&
           graph.clients.front().node == "/front/talker" &&
           graph.services.front().node == "/front/talker";
  }));
  const std::string name = "/front/talker";
  EXPECT_THAT(graph.nodes, ElementsAre(name));
  EXPECT_THAT(graph.publishers, ElementsAre(is("/front/chatter", "std_msgs/msg/String", name)));
  EXPECT_EQ(graph.publishers[0].qos.reliability, Reliability::best_effort);
  EXPECT_THAT(graph.subscriptions, ElementsAre(is("/enable", "std_msgs/msg/Bool", name)));
  EXPECT_THAT(graph.services,
              ElementsAre(is("/front/talker/add", "example_interfaces/srv/AddTwoInts", name)));
  EXPECT_THAT(graph.clients,
              ElementsAre(is("/other/add", "example_interfaces/srv/AddTwoInts", name)));
  if (GetParam() == RosGraph::jazzy) {
    EXPECT_EQ(graph.publishers[0].type_hash,
              "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
    // Of the request and the response, as ROS 2 announces them. It was the service's hash.
    for (const auto& end : {graph.services[0], graph.clients[0]}) {
      EXPECT_EQ(end.type_hash,
                "RIHS01_000c5fd92d6b2e1a05949348f584d6d652adea1e92d691792011ac2273508302");
      EXPECT_EQ(end.response_hash,
                "RIHS01_de5c030d4af33cba2749310b249737b631594703f9300495f48bffb2b44dcc2f");
    }
  } else {
    EXPECT_EQ(graph.publishers[0].type_hash, "");
  }
}

TEST_P(GraphTest, NodesGoAndAreNotSeenAnyMore) {
  auto node = std::make_shared<Node>("short", NodeOptions{.participant = here_});
  const auto sees = [&](std::size_t count) {
    return eventually([&] { return there_->graph().nodes.size() == count; });
  };
  EXPECT_TRUE(sees(1));
  node.reset();
  EXPECT_TRUE(sees(0));
}

TEST_P(GraphTest, AnActionHasAllPartsThatRos2KnowsItBy) {
  const auto node = std::make_shared<Node>("counter", NodeOptions{.participant = here_});
  const auto server = create_action_server<Count>(
      *node, "count", [](const auto&, const auto&) { return GoalResponse::reject; },
      [](const auto&) { return CancelResponse::reject; }, [](const auto&) {});
  const auto client = create_action_client<Count>(*node, "count");
  Graph graph;
  ASSERT_TRUE(eventually([&] {
    graph = there_->graph();
    return graph.services.size() == 3 && graph.clients.size() == 3 &&
           graph.publishers.size() == 2 && graph.subscriptions.size() == 2 &&
           graph.services[2].node == "/counter" && graph.clients[2].node == "/counter" &&
           graph.subscriptions[1].node == "/counter" && graph.publishers[1].node == "/counter";
  }));
  const auto services =
      ElementsAre(is("/count/_action/cancel_goal", "action_msgs/srv/CancelGoal", "/counter"),
                  is("/count/_action/get_result", "test_msgs/action/Count_GetResult", "/counter"),
                  is("/count/_action/send_goal", "test_msgs/action/Count_SendGoal", "/counter"));
  EXPECT_THAT(graph.services, services);
  EXPECT_THAT(graph.clients, services);
  const auto topics = ElementsAre(
      is("/count/_action/feedback", "test_msgs/action/Count_FeedbackMessage", "/counter"),
      is("/count/_action/status", "action_msgs/msg/GoalStatusArray", "/counter"));
  EXPECT_THAT(graph.publishers, topics);
  EXPECT_THAT(graph.subscriptions, topics);
  EXPECT_EQ(graph.publishers[1].qos.durability, Durability::transient_local);
}

// As ROS 2 Jazzy announces them.
TEST(Graph, HashesOfAnActionAreThoseOfItsParts) {
  DdsOptions options;
  options.domain = test_domain();
  options.shared_memory = SharedMemory::off;
  const auto here = Participant::create(options), there = Participant::create(options);
  const auto node = std::make_shared<Node>("counter", NodeOptions{.participant = here});
  const auto client = create_action_client<example_interfaces::action::Fibonacci>(*node, "count");
  Graph graph;
  ASSERT_TRUE(eventually([&] {
    graph = there->graph();
    return graph.clients.size() == 3 && graph.subscriptions.size() == 2 &&
           !graph.clients[0].type_hash.empty();
  }));
  std::vector<std::string> hashes{graph.subscriptions[0].type_hash,
                                  graph.subscriptions[1].type_hash};
  for (const GraphEndpoint& end : graph.clients) {
    hashes.insert(hashes.end(), {end.type_hash, end.response_hash});
  }
  EXPECT_THAT(
      hashes,
      ElementsAre("RIHS01_c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2",
                  "RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
                  "RIHS01_3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af",
                  "RIHS01_35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960",
                  "RIHS01_c8a4f5e7d13b81286ee1043e2ecd084281cecf1ff06aaa799464f5f15479f003",
                  "RIHS01_6021dc98ab9b4bbe395e48aa4de81ee5f68eb570f88358affcc648146668b24f",
                  "RIHS01_3d088942b413247db536576f0286768c6be8fcd5d0c9a5d544f359fba090a238",
                  "RIHS01_d8c07bb3d5b766fe4b43159c9a5222af5214e2fcc29229b991d826166c512be1"));
}

INSTANTIATE_TEST_SUITE_P(Forms, GraphTest, testing::Values(RosGraph::jazzy, RosGraph::humble),
                         [](const auto& form) {
                           return form.param == RosGraph::jazzy ? "jazzy" : "humble";
                         });

TEST(Graph, OffByAWord) {
  DdsOptions options;
  options.domain = test_domain();
  options.shared_memory = SharedMemory::off;
  const auto looks = Participant::create(options);
  options.ros_graph = RosGraph::off;
  const auto hides = Participant::create(options);
  const auto node = std::make_shared<Node>("hidden", NodeOptions{.participant = hides});
  const auto publisher = node->create_publisher<std_msgs::msg::String>("chatter", 1);
  Graph graph;
  ASSERT_TRUE(eventually([&] { return !(graph = looks->graph()).publishers.empty(); }));
  EXPECT_THAT(graph.nodes, IsEmpty());
  EXPECT_EQ(graph.publishers[0].type_hash, "");
}

// ---- On the wire, byte for byte ----

std::string hex(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte byte : bytes) text += fmt::format("{:02x}", std::to_integer<int>(byte));
  return text;
}

/// Two processes' worth of ends: one speaks by types, the other one by bytes.
class WireTest : public testing::Test {
 protected:
  std::shared_ptr<Participant> join(RosGraph form) const {
    DdsOptions options;
    options.domain = test_domain();
    options.shared_memory = SharedMemory::off;
    options.serves_own_process = true;  // both ends are here, and nothing goes by pointer
    options.ros_graph = form;
    return Participant::create(options);
  }
  std::shared_ptr<Node> make(const char* name) const {
    return std::make_shared<Node>(name, NodeOptions{.participant = join(RosGraph::jazzy)});
  }
  static void serve_all(const Node& node) {
    for (const auto& entity : node.entities()) {
      if (entity->kind() != EntityKind::timer) serve(*entity);
    }
  }
  /// What an entity receives next, as bytes.
  std::string next_of(SubscriptionBase& subscription) {
    received_.clear();
    EXPECT_TRUE(eventually([&] { return serve(subscription) && !received_.empty(); }));
    return received_;
  }
  SerializedCallback note() {
    return [this](std::span<const std::byte> bytes, const MessageInfo&) { received_ = hex(bytes); };
  }
  static std::vector<std::byte> bytes(std::string_view text) {
    std::vector<std::byte> result;
    for (std::size_t i = 0; i < text.size(); i += 2) {
      result.push_back(std::byte(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
    }
    return result;
  }
  /// An end by bytes whose topic has a prefix of ROS 2's, that users cannot name.
  std::unique_ptr<GenericPublisher> sender(const std::shared_ptr<Participant>& of,
                                           const std::string& topic, const std::string& type) {
    return std::make_unique<GenericPublisher>(Endpoint{topic, &serialized_type(type), QoS(10)},
                                              Clock::steady(), of);
  }
  std::unique_ptr<GenericSubscription> receiver(const std::shared_ptr<Participant>& of,
                                                const std::string& topic, const std::string& type,
                                                const QoS& qos = 10) {
    auto result = std::make_unique<GenericSubscription>(
        topic, group_, Endpoint{topic, &serialized_type(type), qos}, note(), of);
    result->start();
    return result;
  }
  const std::shared_ptr<CallbackGroup> group_ =
      std::make_shared<CallbackGroup>("group", CallbackGroupType::MutuallyExclusive);
  std::string received_;
};

TEST_F(WireTest, ATopicBothWays) {
  const auto node = make("typed");
  const auto bytewise = join(RosGraph::off);
  const auto publisher = node->create_publisher<std_msgs::msg::String>("chatter", 10);
  std::string heard;
  const auto subscription = node->create_subscription<std_msgs::msg::String>(
      "answers", 10, [&](const std_msgs::msg::String& message) { heard = message.data; });
  const auto reads = receiver(bytewise, "/chatter", "std_msgs/msg/String");
  const auto sends = sender(bytewise, "/answers", "std_msgs/msg/String");
  ASSERT_TRUE(eventually(
      [&] { return publisher->subscription_count() == 1 && sends->subscription_count() == 1; }));
  publisher->publish(std_msgs::msg::String().set__data("hi"));
  EXPECT_EQ(next_of(*reads),
            "00010000"
            "03000000"
            "686900");
  sends->publish(
      bytes("00010000"
            "04000000"
            "796f7500"));
  ASSERT_TRUE(eventually([&] { return serve(*subscription) && !heard.empty(); }));
  EXPECT_EQ(heard, "you");
}

TEST_F(WireTest, AServiceAndAClient) {
  const auto node = make("typed");
  const auto bytewise = join(RosGraph::off);
  const auto service = node->create_service<Add>(
      "add", [](const auto& request, auto& response) { response.sum = request.a + request.b; });
  const auto client = node->create_client<Add>("sub");
  // A client by bytes: guid, sequence, then the fields.
  const auto asks = sender(bytewise, "rq/addRequest", "example_interfaces/srv/AddTwoInts_Request");
  const auto hears =
      receiver(bytewise, "rr/addReply", "example_interfaces/srv/AddTwoInts_Response");
  ASSERT_TRUE(eventually(
      [&] { return asks->subscription_count() == 1 && service->outside_publisher_count() == 1; }));
  const std::string id =
      "1122334455667788"
      "0500000000000000";
  asks->publish(bytes("00010000" + id +
                      "0200000000000000"
                      "0300000000000000"));
  ASSERT_TRUE(eventually([&] { return serve(*service); }));
  EXPECT_EQ(next_of(*hears), "00010000" + id + "0500000000000000");
  // A server by bytes.
  const auto serves =
      receiver(bytewise, "rq/subRequest", "example_interfaces/srv/AddTwoInts_Request");
  const auto answers =
      sender(bytewise, "rr/subReply", "example_interfaces/srv/AddTwoInts_Response");
  ASSERT_TRUE(
      eventually([&] { return client->service_is_ready() && answers->subscription_count() == 1; }));
  const auto future = client->async_send_request({.a = 7, .b = 8});
  const std::string request = next_of(*serves);
  ASSERT_EQ(request.size(), 2 * (4 + 16 + 16u));
  EXPECT_EQ(request.substr(0, 8), "00010000");
  EXPECT_EQ(request.substr(24, 16), "0100000000000000");  // its first call
  EXPECT_EQ(request.substr(40),
            "0700000000000000"
            "0800000000000000");
  answers->publish(bytes(request.substr(0, 40) + "0f00000000000000"));
  ASSERT_TRUE(eventually([&] { return serve(*client) && future.ready(); }));
  EXPECT_EQ(future.get()->sum, 15);
}

// For `takt topic echo` and the recorder: ROS 2 warns of each end without a hash.
TEST_F(WireTest, AnEndByBytesAnnouncesTheHashOfTheEndsThatItMeets) {
  const auto node = make("typed");
  const auto publisher = node->create_publisher<std_msgs::msg::String>("chatter", 10);
  const auto bytewise = join(RosGraph::jazzy);
  ASSERT_TRUE(eventually([&] { return !bytewise->graph().publishers.empty(); }));
  const auto reads = receiver(bytewise, "/chatter", "std_msgs/msg/String");
  const auto observer = join(RosGraph::jazzy);
  const auto hash = [&](const std::vector<GraphEndpoint>& ends) {
    const auto end = std::find_if(ends.begin(), ends.end(),
                                  [](const auto& each) { return each.name == "/chatter"; });
    return end != ends.end() ? end->type_hash : "";
  };
  ASSERT_TRUE(eventually([&] { return !hash(observer->graph().subscriptions).empty(); }));
  EXPECT_EQ(hash(observer->graph().subscriptions),
            type_hash(message_type<std_msgs::msg::String>()));
}

TEST_F(WireTest, WhatAProcessAnnouncesAboutItsNodes) {
  const auto bytewise = join(RosGraph::off);
  const auto reads =
      receiver(bytewise, "ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo",
               QoS(1).transient_local());
  const auto node = make("n");
  const std::string heard = next_of(*reads);
  // Header, gid of the participant, one node: "/", "n", no readers, no writers.
  ASSERT_EQ(heard.size(), 2 * (4 + 16 + 4 + 8 + 8 + 8u));
  EXPECT_EQ(heard.substr(40),
            "01000000"
            "02000000"
            "2f000000"
            "02000000"
            "6e000000"
            "00000000"
            "00000000");
}

TEST_F(WireTest, ThePartsOfAnAction) {
  const auto node = make("typed");
  const auto bytewise = join(RosGraph::off);
  std::shared_ptr<ServerGoalHandle<Count>> goal;
  const auto server = create_action_server<Count>(
      *node, "count", [](const auto&, const auto&) { return GoalResponse::accept_and_execute; },
      [](const auto&) { return CancelResponse::accept; }, [&](auto handle) { goal = handle; });
  const auto all = [&] { serve_all(*node); };
  const std::string action = "/count/_action/", type = "test_msgs/action/Count_";
  const auto send = sender(bytewise, "rq" + action + "send_goalRequest", type + "SendGoal_Request");
  const auto sent =
      receiver(bytewise, "rr" + action + "send_goalReply", type + "SendGoal_Response");
  const auto ask =
      sender(bytewise, "rq" + action + "get_resultRequest", type + "GetResult_Request");
  const auto results =
      receiver(bytewise, "rr" + action + "get_resultReply", type + "GetResult_Response");
  const auto cancel =
      sender(bytewise, "rq" + action + "cancel_goalRequest", "action_msgs/srv/CancelGoal_Request");
  const auto canceled =
      receiver(bytewise, "rr" + action + "cancel_goalReply", "action_msgs/srv/CancelGoal_Response");
  const auto feedback = receiver(bytewise, action + "feedback", type + "FeedbackMessage");
  const auto status = receiver(bytewise, action + "status", "action_msgs/msg/GoalStatusArray",
                               QoS(1).transient_local());
  ASSERT_TRUE(eventually([&] {
    return send->subscription_count() == 1 && ask->subscription_count() == 1 &&
           cancel->subscription_count() == 1;
  }));
  const std::string client = "01020304050607080100000000000000", id(32, 'a');
  send->publish(bytes("00010000" + client + id + "05000000"));
  ASSERT_TRUE(eventually([&] { return all(), goal != nullptr; }));
  EXPECT_EQ(goal->goal().to, 5);
  // accepted, padded to the stamp
  const std::string accepted = next_of(*sent);
  ASSERT_EQ(accepted.size(), 2 * (4 + 16 + 4 + 8u));
  EXPECT_EQ(accepted.substr(0, 48), "00010000" + client + "01000000");
  const std::string stamp = accepted.substr(48);
  goal->publish_feedback({4});
  EXPECT_EQ(next_of(*feedback), "00010000" + id + "04000000");
  cancel->publish(bytes("00010000" + client + id + "0000000000000000"));
  ASSERT_TRUE(eventually([&] { return all(), goal->is_canceling(); }));
  EXPECT_EQ(next_of(*canceled), "00010000" + client + "0000000001000000" + id + stamp);
  ask->publish(bytes("00010000" + client + id));
  ASSERT_TRUE(eventually([&] { return all(), ask->subscription_count() == 1; }));
  goal->canceled({3});
  all();
  std::string last;  // of the reported states
  ASSERT_TRUE(eventually([&] {
    while (serve(*status)) last = received_;
    return last == "0001000001000000" + id + stamp + "05";
  })) << last;
  // It may have been asked before or after the end.
  ASSERT_TRUE(eventually([&] { return all(), received_.clear(), serve(*results); }));
  EXPECT_EQ(received_, "00010000" + client + "0500000003000000");
}

// The other way round: the client has types, and the server is bytes.
TEST_F(WireTest, AnActionsClient) {
  const auto node = make("typed");
  const auto bytewise = join(RosGraph::off);
  const auto client = create_action_client<Count>(*node, "count");
  const std::string action = "/count/_action/", type = "test_msgs/action/Count_";
  const auto asked =
      receiver(bytewise, "rq" + action + "send_goalRequest", type + "SendGoal_Request");
  const auto answers =
      sender(bytewise, "rr" + action + "send_goalReply", type + "SendGoal_Response");
  const auto wanted =
      receiver(bytewise, "rq" + action + "get_resultRequest", type + "GetResult_Request");
  const auto results =
      sender(bytewise, "rr" + action + "get_resultReply", type + "GetResult_Response");
  const auto cancels = receiver(bytewise, "rq" + action + "cancel_goalRequest",
                                "action_msgs/srv/CancelGoal_Request");
  const auto canceled =
      sender(bytewise, "rr" + action + "cancel_goalReply", "action_msgs/srv/CancelGoal_Response");
  const auto feedback = sender(bytewise, action + "feedback", type + "FeedbackMessage");
  ASSERT_TRUE(eventually([&] {
    return client->action_server_is_ready() && answers->subscription_count() == 1 &&
           results->subscription_count() == 1 && canceled->subscription_count() == 1 &&
           feedback->subscription_count() == 1;
  }));
  const auto all = [&] { serve_all(*node); };
  std::shared_ptr<ClientGoalHandle> goal;
  std::int32_t fed = 0, reached = 0;
  GoalState end = GoalState::unknown;
  std::size_t canceling = 0;
  client->async_send_goal({.to = 9}, {.response = [&](const auto& handle) { goal = handle; },
                                      .feedback = [&](const auto&, const auto& f) { fed = f.now; },
                                      .result =
                                          [&](const auto&, const auto& result) {
                                            end = result.state;
                                            reached = result.result.reached;
                                          }});
  const std::string request = next_of(*asked);
  ASSERT_EQ(request.size(), 2 * (4 + 16 + 16 + 4u));
  const std::string header = request.substr(8, 32), id = request.substr(40, 32);
  EXPECT_EQ(request.substr(72), "09000000");
  const std::string stamp = "0100000002000000";
  answers->publish(bytes("00010000" + header + "01000000" + stamp));
  ASSERT_TRUE(eventually([&] { return all(), goal != nullptr; }));
  EXPECT_EQ(goal->stamp().nanosec, 2u);
  feedback->publish(bytes("00010000" + id + "04000000"));
  ASSERT_TRUE(eventually([&] { return all(), fed == 4; }));
  const std::string asks = next_of(*wanted);
  EXPECT_EQ(asks.substr(40), id);
  client->async_cancel_goal(goal,
                            [&](const auto& answer) { canceling = answer.goals_canceling.size(); });
  const std::string cancel = next_of(*cancels);
  EXPECT_EQ(cancel.substr(40), id + "0000000000000000");
  canceled->publish(bytes("00010000" + cancel.substr(8, 32) + "0000000001000000" + id + stamp));
  ASSERT_TRUE(eventually([&] { return all(), canceling == 1; }));
  results->publish(bytes("00010000" + asks.substr(8, 32) + "0500000003000000"));
  ASSERT_TRUE(eventually([&] { return all(), end == GoalState::canceled; }));
  EXPECT_EQ(reached, 3);
}

}  // namespace
}  // namespace takt::graph_test
