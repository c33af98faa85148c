// The rover's controller: at each message of the base it says how fast to drive, until a goal's
// distance is behind it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <geometry_msgs/msg/twist.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_action/rclcpp_action.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>
#include <rover_msgs/action/drive.hpp>
#include <rover_msgs/msg/travel.hpp>

namespace rover_control {

using rover_msgs::action::Drive;
using rover_msgs::msg::Travel;

class Controller : public rclcpp_lifecycle::LifecycleNode {
 public:
  explicit Controller(const rclcpp::NodeOptions& options) : LifecycleNode("controller", options) {
    declare_parameter("gain", 2.0, described("speed, 1/s, at each metre that remains", 0.1, 10.0));
    declare_parameter("max_speed", 0.5, described("m/s", 0.0, 2.0));
    // Made at once, so that a chain of a file of Takt can go through it.
    commands_ = create_publisher<geometry_msgs::msg::Twist>("cmd_vel", 10);
    travels_ = create_subscription<Travel>("travel", 10,
                                           [this](const Travel& travel) { step(travel.distance); });
  }

 private:
  using Goal = rclcpp_action::ServerGoalHandle<Drive>;

  static rcl_interfaces::msg::ParameterDescriptor described(const char* text, double from,
                                                            double to) {
    rcl_interfaces::msg::ParameterDescriptor descriptor;
    descriptor.description = text;
    descriptor.floating_point_range.resize(1);
    descriptor.floating_point_range[0].from_value = from;
    descriptor.floating_point_range[0].to_value = to;
    return descriptor;
  }

  CallbackReturn on_configure(const rclcpp_lifecycle::State&) override {
    goals_ = rclcpp_action::create_server<Drive>(
        this, "drive",
        [this](const rclcpp_action::GoalUUID&, std::shared_ptr<const Drive::Goal> goal) {
          return commands_->is_activated() && std::isfinite(goal->distance)
                     ? rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE
                     : rclcpp_action::GoalResponse::REJECT;
        },
        [](const std::shared_ptr<Goal>&) { return rclcpp_action::CancelResponse::ACCEPT; },
        [this](const std::shared_ptr<Goal>& goal) {
          if (goal_) end(&Goal::abort);
          goal_ = goal;
          start_.reset();
        });
    return CallbackReturn::SUCCESS;
  }
  CallbackReturn on_deactivate(const rclcpp_lifecycle::State& state) override {
    if (goal_) end(&Goal::abort);
    return LifecycleNode::on_deactivate(state);
  }
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State&) override {
    goals_.reset();
    return CallbackReturn::SUCCESS;
  }

  // `at`: how far the rover has come.
  void step(double at) {
    if (!goal_) return;
    if (!start_) start_ = at;
    travelled_ = at - *start_;
    auto feedback = std::make_shared<Drive::Feedback>();
    feedback->remaining = goal_->get_goal()->distance - travelled_;
    if (goal_->is_canceling()) return end(&Goal::canceled);
    if (std::abs(feedback->remaining) < 0.01) return end(&Goal::succeed);
    goal_->publish_feedback(feedback);
    const double most = get_parameter("max_speed").as_double();
    send(std::clamp(get_parameter("gain").as_double() * feedback->remaining, -most, most));
  }

  void end(void (Goal::*how)(Drive::Result::SharedPtr)) {
    send(0);
    auto result = std::make_shared<Drive::Result>();
    result->travelled = travelled_;
    ((*std::exchange(goal_, nullptr)).*how)(result);
  }

  void send(double speed) {
    geometry_msgs::msg::Twist command;
    command.linear.x = speed;
    commands_->publish(command);
  }

  std::shared_ptr<Goal> goal_;
  std::optional<double> start_;  // where the goal began
  double travelled_ = 0;
  rclcpp_lifecycle::LifecyclePublisher<geometry_msgs::msg::Twist>::SharedPtr commands_;
  rclcpp::Subscription<Travel>::SharedPtr travels_;
  rclcpp_action::Server<Drive>::SharedPtr goals_;
};

}  // namespace rover_control

RCLCPP_COMPONENTS_REGISTER_NODE(rover_control::Controller)
