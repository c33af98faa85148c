// Messages, names and QoS of actions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ACTION_HPP_
#define TAKT_ROS2_ACTION_HPP_

#include <cstdint>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/messages/action_msgs/msg/goal_status_array.hpp"
#include "takt/messages/action_msgs/srv/cancel_goal.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// A type that describes an action: `struct Fibonacci { struct Goal {...}; struct Result {...};
/// struct Feedback {...}; };`, with TAKT_MESSAGE(Fibonacci::Goal,
/// "example_interfaces/action/Fibonacci_Goal", order) and so on. An .action file generates one.
template <class A>
concept ActionType =
    Message<typename A::Goal> && Message<typename A::Result> && Message<typename A::Feedback>;

/// The UUID of a goal, made by its client.
using GoalId = unique_identifier_msgs::msg::UUID;
using action_msgs::srv::CancelGoal;
GoalId new_goal_id();
/// "1f0a…": 32 hexadecimal digits.
std::string to_string(const GoalId& id);

/// The values of GoalStatus::status in messages.
enum class GoalState : std::int8_t {
  unknown = 0,
  accepted = 1,
  executing = 2,
  canceling = 3,
  succeeded = 4,
  canceled = 5,
  aborted = 6,
};
constexpr bool is_terminal(GoalState state) noexcept {
  return state == GoalState::succeeded || state == GoalState::canceled ||
         state == GoalState::aborted;
}
std::string_view to_string(GoalState state) noexcept;

/// Suffixes of the services and topics of an action, as in ROS 2.
inline constexpr const char* kSendGoal = "/_action/send_goal";
inline constexpr const char* kCancelGoal = "/_action/cancel_goal";
inline constexpr const char* kGetResult = "/_action/get_result";
inline constexpr const char* kFeedback = "/_action/feedback";
inline constexpr const char* kStatus = "/_action/status";

/// A late joiner learns the state of all goals.
inline QoS status_qos() {
  return QoS(1).transient_local();
}

// ---- The messages that ROS 2 makes of an action's three ----

template <ActionType A>
struct SendGoal {
  struct Request {
    GoalId goal_id;
    typename A::Goal goal{};

    static constexpr std::string_view kName = "_SendGoal_Request";
    using Action = A;
    template <class Visitor, class Self>
    static void visit(Visitor& visitor, Self& self) {
      visitor(self.goal_id), visitor(self.goal);
    }
    static const MessageType& describe(std::string_view name) {
      return detail::make_message_type(
          name, detail::kLayoutOf<Request>,
          {detail::describe_field<GoalId>("goal_id", offsetof(Request, goal_id)),
           detail::describe_field<typename A::Goal>("goal", offsetof(Request, goal))});
    }
  };
  struct Response {
    bool accepted = false;
    builtin_interfaces::msg::Time stamp;

    static constexpr std::string_view kName = "_SendGoal_Response";
    using Action = A;
    template <class Visitor, class Self>
    static void visit(Visitor& visitor, Self& self) {
      visitor(self.accepted), visitor(self.stamp);
    }
    static const MessageType& describe(std::string_view name) {
      return detail::make_message_type(
          name, detail::kLayoutOf<Response>,
          {detail::describe_field<bool>("accepted", offsetof(Response, accepted)),
           detail::describe_field<builtin_interfaces::msg::Time>("stamp",
                                                                 offsetof(Response, stamp))});
    }
  };
};

template <ActionType A>
struct GetResult {
  struct Request {
    GoalId goal_id;

    static constexpr std::string_view kName = "_GetResult_Request";
    using Action = A;
    template <class Visitor, class Self>
    static void visit(Visitor& visitor, Self& self) {
      visitor(self.goal_id);
    }
    static const MessageType& describe(std::string_view name) {
      return detail::make_message_type(
          name, detail::kLayoutOf<Request>,
          {detail::describe_field<GoalId>("goal_id", offsetof(Request, goal_id))});
    }
  };
  struct Response {
    std::int8_t status = 0;  // the value of a GoalState
    typename A::Result result{};

    static constexpr std::string_view kName = "_GetResult_Response";
    using Action = A;
    template <class Visitor, class Self>
    static void visit(Visitor& visitor, Self& self) {
      visitor(self.status), visitor(self.result);
    }
    static const MessageType& describe(std::string_view name) {
      return detail::make_message_type(
          name, detail::kLayoutOf<Response>,
          {detail::describe_field<std::int8_t>("status", offsetof(Response, status)),
           detail::describe_field<typename A::Result>("result", offsetof(Response, result))});
    }
  };
};

template <ActionType A>
struct FeedbackMessage {
  GoalId goal_id;
  typename A::Feedback feedback{};

  static constexpr std::string_view kName = "_FeedbackMessage";
  using Action = A;
  template <class Visitor, class Self>
  static void visit(Visitor& visitor, Self& self) {
    visitor(self.goal_id), visitor(self.feedback);
  }
  static const MessageType& describe(std::string_view name) {
    return detail::make_message_type(
        name, detail::kLayoutOf<FeedbackMessage>,
        {detail::describe_field<GoalId>("goal_id", offsetof(FeedbackMessage, goal_id)),
         detail::describe_field<typename A::Feedback>("feedback",
                                                      offsetof(FeedbackMessage, feedback))});
  }
};

template <class T>
concept ActionPart = ActionType<typename T::Action> && requires {
  T::kName;
  T::describe(std::string_view());
};

template <ActionPart T>
const MessageType& takt_message_type(const T*) {
  static const MessageType& type = []() -> const MessageType& {
    constexpr std::string_view kGoal = "_Goal";
    std::string name = message_type<typename T::Action::Goal>().name;
    if (name.ends_with(kGoal)) name.resize(name.size() - kGoal.size());
    return T::describe(name.append(T::kName));
  }();
  return type;
}

template <class Visitor, class T>
requires ActionPart<std::remove_const_t<T>>
void takt_visit_fields(Visitor& visitor, T& message) {
  T::visit(visitor, message);
}

}  // namespace takt

#endif  // TAKT_ROS2_ACTION_HPP_
