// What ros2_commands_test.py looks at from outside: parameters of all types, actions, a service
// that never answers, and a container as ROS 2's.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <unistd.h>

#include "takt/containers/component.hpp"
#include "takt/containers/structure.hpp"
#include "takt/messages/composition_interfaces/srv/list_nodes.hpp"
#include "takt/messages/composition_interfaces/srv/load_node.hpp"
#include "takt/messages/example_interfaces/action/fibonacci.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_state.hpp"
#include "takt/messages/rcl_interfaces/srv/list_parameters.hpp"
#include "takt/messages/service_msgs/msg/service_event_info.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/messages/type_description_interfaces/srv/get_type_description.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/ros2/action_server.hpp"

namespace peers {

using example_interfaces::action::Fibonacci;
using namespace std::chrono_literals;

class Parameters : public takt::Node {
 public:
  explicit Parameters(const takt::NodeOptions& options) : Node("parameters", options) {
    declare_parameter("flag", true);
    declare_parameter("count", std::int64_t{3},
                      {.description = "how many",
                       .integer_range = takt::IntegerRange{.from_value = 0, .to_value = 10}});
    declare_parameter("gain.p", 1.0);
    declare_parameter("gain.i", 1e20);
    declare_parameter("limit", std::numeric_limits<double>::infinity());
    declare_parameter("word", std::string("it's on"));
    declare_parameter("fixed", std::string("on"), {.read_only = true});
    declare_parameter("any", takt::ParameterValue(std::int64_t{1}),
                      {.additional_constraints = "no list", .dynamic_typing = true});
    declare_parameter("bytes", std::vector<std::uint8_t>{0, 255});
    declare_parameter("flags", std::vector<bool>{true, false});
    declare_parameter("counts", std::vector<std::int64_t>{1, 2});
    declare_parameter("gains", std::vector<double>{0.5, 2.0});
    declare_parameter("words", std::vector<std::string>{"a", "yes"});
  }
};

// A node, a container and a lifecycle node that never answers. Its container must not serve its
// parameters.
class Mute : public takt::Node {
 public:
  explicit Mute(const takt::NodeOptions& options) : Node("mute", options) {
    never_answer<rcl_interfaces::srv::ListParameters>("/mute/list_parameters");
    never_answer<composition_interfaces::srv::ListNodes>("/mute/_container/list_nodes");
    never_answer<takt::GetStructure>("/mute/_container/get_structure");
    never_answer<lifecycle_msgs::srv::GetState>("/mute/get_state");
    never_answer<lifecycle_msgs::srv::ChangeState>("/mute/change_state");
  }

 private:
  template <class S>
  void never_answer(const char* name) {
    services_.push_back(create_service<S>(
        name, [](const typename S::Request&, typename S::Response&) -> takt::Task<> {
          co_await takt::sleep_for(1h);
        }));
  }

  std::vector<std::shared_ptr<takt::Entity>> services_;
};

class Stateful : public takt::LifecycleNode {
 public:
  explicit Stateful(const takt::NodeOptions& options) : LifecycleNode("stateful", options) {}
};

// Orders: 0 to 9 succeed, 10 is aborted, 11 lasts until it is canceled, 12 lasts and refuses to be
// canceled; the rest is rejected.
class Counter : public takt::Node {
 public:
  using Goal = takt::ServerGoalHandle<Fibonacci>;

  explicit Counter(const takt::NodeOptions& options)
      : Node("counter", options),
        server_(takt::create_action_server<Fibonacci>(
            *this, "fibonacci",
            [](const takt::GoalId&, const Fibonacci::Goal& goal) {
              return goal.order <= 12 ? takt::GoalResponse::accept_and_execute
                                      : takt::GoalResponse::reject;
            },
            [](const std::shared_ptr<Goal>& goal) {
              return goal->goal().order == 12 ? takt::CancelResponse::reject
                                              : takt::CancelResponse::accept;
            },
            [](std::shared_ptr<Goal> goal) { return execute(std::move(goal)); })) {}

 private:
  static takt::Task<> execute(std::shared_ptr<Goal> goal) {
    const int order = goal->goal().order;
    std::vector<std::int32_t> sequence{0, 1};
    for (int i = 2; i <= order && i < 10; ++i) {
      sequence.push_back(sequence[sequence.size() - 2] + sequence.back());
    }
    goal->publish_feedback(Fibonacci::Feedback().set__sequence(sequence));
    while (order > 10 && !goal->is_canceling()) co_await takt::sleep_for(10ms);
    const auto result = Fibonacci::Result().set__sequence(sequence);
    if (order < 10) goal->succeed(result);
    if (order == 10) goal->abort(result);
    if (order > 10) goal->canceled(result);
  }

  const std::shared_ptr<takt::ActionServer<Fibonacci>> server_;
};

// A container as rclcpp's: it has no service of Takt's, and wants the package. Its "node" is what
// it was asked for. A component `Crash` ends the process.
class Ros2Container : public takt::Node {
 public:
  using Load = composition_interfaces::srv::LoadNode;

  explicit Ros2Container(const takt::NodeOptions& options) : Node("ros2_container", options) {
    service_ = create_service<Load>(
        "~/_container/load_node", [](const Load::Request& request, Load::Response& response) {
          if (request.plugin_name == "Crash") _exit(3);
          response.success = true;
          response.unique_id = 1;
          response.full_node_name = request.package_name + "/" + request.plugin_name;
        });
  }

 private:
  std::shared_ptr<takt::Service<Load>> service_;
};

// Types that the command does not have.
struct Joint {
  double angle = 0;
};
TAKT_MESSAGE(Joint, "peer_msgs/msg/Joint", angle);
struct Leg {
  std::string name;
  std::u16string note;
  std::vector<Joint> joints;
};
TAKT_MESSAGE(Leg, "peer_msgs/msg/Leg", name, note, joints);
struct Turn {
  struct Request {
    std::array<Joint, 2> by;
  };
  struct Response {
    Joint sum;
  };
};
TAKT_MESSAGE(Turn::Request, "peer_msgs/srv/Turn_Request", by);
TAKT_MESSAGE(Turn::Response, "peer_msgs/srv/Turn_Response", sum);
struct Walk {
  struct Goal {
    Joint to;
  };
  struct Result {
    std::string said;
  };
  struct Feedback {
    Leg now;
  };
};
TAKT_MESSAGE(Walk::Goal, "peer_msgs/action/Walk_Goal", to);
TAKT_MESSAGE(Walk::Result, "peer_msgs/action/Walk_Result", said);
TAKT_MESSAGE(Walk::Feedback, "peer_msgs/action/Walk_Feedback", now);

// Publishes what it gets on `in` on `out`, again and again; adds; walks.
class Spider : public takt::Node {
 public:
  explicit Spider(const takt::NodeOptions& options)
      : Node("spider", options), out_(create_publisher<Leg>("out", takt::QoS(1))) {
    in_ = create_subscription<Leg>("in", takt::QoS(1), [this](const Leg& leg) { leg_ = leg; });
    timer_ = create_timer("again", 20ms, [this] { out_->publish(leg_); });
    turn_ =
        create_service<Turn>("turn", [](const Turn::Request& request, Turn::Response& response) {
          response.sum.angle = request.by[0].angle + request.by[1].angle;
        });
    walk_ = takt::create_action_server<Walk>(
        *this, "walk",
        [](const takt::GoalId&, const Walk::Goal&) {
          return takt::GoalResponse::accept_and_execute;
        },
        [](const auto&) { return takt::CancelResponse::accept; },
        [](std::shared_ptr<takt::ServerGoalHandle<Walk>> goal) -> takt::Task<> {
          goal->publish_feedback({{"left", u"\u00fc", {goal->goal().to}}});
          goal->succeed({"done"});
          co_return;
        });
  }

 private:
  Leg leg_{"left", u"\u20ac", {{1}, {2.5}}};
  const std::shared_ptr<takt::Publisher<Leg>> out_;
  std::shared_ptr<takt::Subscription<Leg>> in_;
  std::shared_ptr<takt::Timer> timer_;
  std::shared_ptr<takt::Service<Turn>> turn_;
  std::shared_ptr<takt::ActionServer<Walk>> walk_;
};

struct TurnEvent {
  service_msgs::msg::ServiceEventInfo info;
  takt::Bounded<std::vector<Turn::Request>, 1> request;
  takt::Bounded<std::vector<Turn::Response>, 1> response;
};
TAKT_MESSAGE(TurnEvent, "peer_msgs/srv/Turn_Event", info, request, response);

// Describes its types as rcl does: a message by its hash, and a service by the service's, which
// ROS 2 announces nowhere. Its container must not describe them.
class Ros2Turner : public takt::Node {
 public:
  using Describe = type_description_interfaces::srv::GetTypeDescription;

  explicit Ros2Turner(const takt::NodeOptions& options) : Node("turner", options) {
    add(takt::describe_service(takt::message_type<Turn::Request>(),
                               takt::message_type<Turn::Response>()));
    turn_ =
        create_service<Turn>("turn", [](const Turn::Request& request, Turn::Response& response) {
          response.sum.angle = request.by[0].angle + request.by[1].angle;
        });
    describe_ = create_service<Describe>(
        "~/get_type_description",
        [this](const Describe::Request& request, Describe::Response& response) {
          const auto known = types_.find(request.type_hash);
          response.successful = known != types_.end();
          if (response.successful) response.type_description = known->second;
        });
  }

 protected:
  void add(const std::optional<takt::TypeDescription>& type) {
    types_[takt::type_hash(type.value())] = type.value();
  }

 private:
  std::map<std::string, takt::TypeDescription> types_;
  std::shared_ptr<takt::Service<Turn>> turn_;
  std::shared_ptr<takt::Service<Describe>> describe_;
};

// Its service's introspection is on, so that it has a topic for the calls.
class IntrospectedTurner : public Ros2Turner {
 public:
  explicit IntrospectedTurner(const takt::NodeOptions& options)
      : Ros2Turner(options),
        events_(create_publisher<TurnEvent>("turn/_service_event", takt::QoS(1))) {
    add(takt::describe(takt::message_type<TurnEvent>()));
  }

 private:
  const std::shared_ptr<takt::Publisher<TurnEvent>> events_;
};

/// Announces what a program without Takt could: names and a node that ROS 2 does not permit.
class Hostile : public takt::Node {
 public:
  explicit Hostile(const takt::NodeOptions& options)
      : Node("hostile", options), participant_(options.participant) {
    for (const char* name : {"/1abc", "/a//b", "/a/", "/", "/odd"}) {
      writers_.push_back(participant_->create_writer({name, &type_, takt::QoS(1), kNode}));
    }
    participant_->add_node(kNode);
  }
  ~Hostile() override { participant_->remove_node(kNode); }

 private:
  static constexpr const char* kNode = "/no\xff\x1b[31m\nde";
  std::shared_ptr<takt::Participant> participant_;
  const takt::MessageType type_ = [] {
    takt::MessageType type = takt::message_type<std_msgs::msg::String>();
    type.name = "ev\x1b]0;owned\x07il/msg/A\nb  9  9";
    return type;
  }();
  std::vector<std::unique_ptr<takt::RemoteWriter>> writers_;
};

}  // namespace peers

TAKT_REGISTER_COMPONENT(peers::Parameters)
TAKT_REGISTER_COMPONENT(peers::Mute)
TAKT_REGISTER_COMPONENT(peers::Stateful)
TAKT_REGISTER_COMPONENT(peers::Counter)
TAKT_REGISTER_COMPONENT(peers::Ros2Container)
TAKT_REGISTER_COMPONENT(peers::Spider)
TAKT_REGISTER_COMPONENT(peers::Ros2Turner)
TAKT_REGISTER_COMPONENT(peers::IntrospectedTurner)
TAKT_REGISTER_COMPONENT(peers::Hostile)
