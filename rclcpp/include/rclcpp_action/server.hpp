// Action servers, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__SERVER_HPP_
#define RCLCPP_ACTION__SERVER_HPP_

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "takt/ros2/action_server.hpp"

#include "rclcpp/create_publisher.hpp"
#include "rclcpp_action/types.hpp"

/// How long results of goals that have ended are kept.
struct rcl_action_server_options_t {
  struct {
    std::int64_t nanoseconds = 10'000'000'000;
  } result_timeout;
};
inline rcl_action_server_options_t rcl_action_server_get_default_options() {
  return {};
}

namespace rclcpp_action {

/// A goal. If the last pointer to it goes before the goal has ended, the goal is aborted.
/// Thread safety: every method from any thread; it may outlive its server.
/// Real-time: as takt::ServerGoalHandle.
template <class A>
class ServerGoalHandle {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ServerGoalHandle)
  explicit ServerGoalHandle(std::shared_ptr<takt::ServerGoalHandle<A>> goal)
      : takt_(std::move(goal)) {}

  std::shared_ptr<const typename A::Goal> get_goal() const { return {takt_, &takt_->goal()}; }
  const GoalUUID& get_goal_id() const { return takt_->id().uuid; }
  bool is_canceling() const { return takt_->is_canceling(); }
  bool is_active() const { return takt_->is_active(); }
  bool is_executing() const { return takt_->state() == takt::GoalState::executing; }

  void publish_feedback(std::shared_ptr<typename A::Feedback> feedback) {
    takt_->publish_feedback(*feedback);
  }
  void succeed(typename A::Result::SharedPtr result) { takt_->succeed(*result); }
  void abort(typename A::Result::SharedPtr result) { takt_->abort(*result); }
  void canceled(typename A::Result::SharedPtr result) { takt_->canceled(*result); }
  void execute() { takt_->execute(); }

 private:
  const std::shared_ptr<takt::ServerGoalHandle<A>> takt_;
};

class ServerBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ServerBase)
  virtual ~ServerBase() = default;
};

/// Thread safety and real-time: as takt::ActionServer.
template <class A>
class Server : public ServerBase {
  using Handle = ServerGoalHandle<A>;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Server)
  using GoalCallback =
      std::function<GoalResponse(const GoalUUID&, std::shared_ptr<const typename A::Goal>)>;
  using CancelCallback = std::function<CancelResponse(std::shared_ptr<Handle>)>;
  using AcceptedCallback = std::function<void(std::shared_ptr<Handle>)>;

  Server(rclcpp::node_interfaces::NodeBaseInterface& node, const std::string& name,
         GoalCallback handle_goal, CancelCallback handle_cancel, AcceptedCallback handle_accepted,
         const rcl_action_server_options_t& options, rclcpp::CallbackGroup::SharedPtr group)
      : takt_(takt::create_action_server<A>(
            *node.takt_node(), node.resolve_topic_or_service_name(name, true),
            [handle_goal = std::move(handle_goal)](const takt::GoalId& id,
                                                   const typename A::Goal& goal) {
              switch (handle_goal(id.uuid, std::make_shared<const typename A::Goal>(goal))) {
                case GoalResponse::ACCEPT_AND_EXECUTE:
                  return takt::GoalResponse::accept_and_execute;
                case GoalResponse::ACCEPT_AND_DEFER:
                  return takt::GoalResponse::accept_and_defer;
                default:
                  return takt::GoalResponse::reject;
              }
            },
            [handle_cancel =
                 std::move(handle_cancel)](const std::shared_ptr<takt::ServerGoalHandle<A>>& goal) {
              return handle_cancel(std::make_shared<Handle>(goal)) == CancelResponse::ACCEPT
                         ? takt::CancelResponse::accept
                         : takt::CancelResponse::reject;
            },
            [handle_accepted =
                 std::move(handle_accepted)](std::shared_ptr<takt::ServerGoalHandle<A>> goal) {
              handle_accepted(std::make_shared<Handle>(std::move(goal)));
            },
            {.most_goals = 100,
             .result_timeout = takt::Nanoseconds(options.result_timeout.nanoseconds),
             .goal_group = group,
             .cancel_group = group,
             .result_group = group,
             .execute_group = group})) {}

 private:
  const std::shared_ptr<takt::ActionServer<A>> takt_;
};

template <class A, class N>
typename Server<A>::SharedPtr create_server(
    N&& node, const std::string& name, typename Server<A>::GoalCallback handle_goal,
    typename Server<A>::CancelCallback handle_cancel,
    typename Server<A>::AcceptedCallback handle_accepted,
    const rcl_action_server_options_t& options = rcl_action_server_get_default_options(),
    rclcpp::CallbackGroup::SharedPtr group = nullptr) {
  return std::make_shared<Server<A>>(rclcpp::detail::base_of(node), name, std::move(handle_goal),
                                     std::move(handle_cancel), std::move(handle_accepted), options,
                                     std::move(group));
}
template <class A, class Base, class Clock, class Logging, class Waitables>
typename Server<A>::SharedPtr create_server(
    std::shared_ptr<Base> base, Clock, Logging, Waitables, const std::string& name,
    typename Server<A>::GoalCallback handle_goal, typename Server<A>::CancelCallback handle_cancel,
    typename Server<A>::AcceptedCallback handle_accepted,
    const rcl_action_server_options_t& options = rcl_action_server_get_default_options(),
    rclcpp::CallbackGroup::SharedPtr group = nullptr) {
  return create_server<A>(std::move(base), name, std::move(handle_goal), std::move(handle_cancel),
                          std::move(handle_accepted), options, std::move(group));
}

}  // namespace rclcpp_action

#endif  // RCLCPP_ACTION__SERVER_HPP_
