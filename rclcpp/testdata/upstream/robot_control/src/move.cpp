// Loads and activates the two controllers of upstream_test.py, as ros2_control's spawner in Python
// does, moves a joint to 1, and says where it was seen.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

#include "control_msgs/action/follow_joint_trajectory.hpp"
#include "controller_manager_msgs/srv/configure_controller.hpp"
#include "controller_manager_msgs/srv/load_controller.hpp"
#include "controller_manager_msgs/srv/switch_controller.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_action/rclcpp_action.hpp"
#include "sensor_msgs/msg/joint_state.hpp"

namespace {

using namespace std::chrono_literals;
using Follow = control_msgs::action::FollowJointTrajectory;

template <class Future>
auto wait(const rclcpp::Node::SharedPtr& node, Future& future, const char* what) {
  if (rclcpp::spin_until_future_complete(node, future, 10s) != rclcpp::FutureReturnCode::SUCCESS) {
    throw std::runtime_error(std::string("nothing came of ") + what);
  }
  return future.get();
}

template <class Service>
void call(const rclcpp::Node::SharedPtr& node, const char* name,
          typename Service::Request::SharedPtr request) {
  const auto client = node->create_client<Service>(std::string("/controller_manager/") + name);
  if (!client->wait_for_service(10s)) throw std::runtime_error(std::string("there is no ") + name);
  auto future = client->async_send_request(request);
  if (!wait(node, future, name)->ok) throw std::runtime_error(std::string(name) + " has failed");
}

void activate(const rclcpp::Node::SharedPtr& node, const std::string& controller) {
  using namespace controller_manager_msgs::srv;
  const auto load = std::make_shared<LoadController::Request>();
  const auto configure = std::make_shared<ConfigureController::Request>();
  const auto change = std::make_shared<SwitchController::Request>();
  load->name = configure->name = controller;
  change->activate_controllers = {controller};
  change->strictness = SwitchController::Request::STRICT;
  call<LoadController>(node, "load_controller", load);
  call<ConfigureController>(node, "configure_controller", configure);
  call<SwitchController>(node, "switch_controller", change);
}

void move(const rclcpp::Node::SharedPtr& node) {
  const auto client = rclcpp_action::create_client<Follow>(node, "/arm/follow_joint_trajectory");
  if (!client->wait_for_action_server(10s)) throw std::runtime_error("there is no action");
  Follow::Goal goal;
  goal.trajectory.joint_names = {"turn"};
  goal.trajectory.points.resize(1);
  goal.trajectory.points[0].positions = {1.0};
  goal.trajectory.points[0].time_from_start = rclcpp::Duration(1s);
  auto sent = client->async_send_goal(goal);
  const auto handle = wait(node, sent, "the goal");
  if (handle == nullptr) throw std::runtime_error("the goal was rejected");
  auto result = client->async_get_result(handle);
  std::printf("error code %d\n", wait(node, result, "the result").result->error_code);
}

}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("move");
  double position = 0, between = 0;
  const auto subscription = node->create_subscription<sensor_msgs::msg::JointState>(
      "/joint_states", 10, [&](const sensor_msgs::msg::JointState& state) {
        position = state.position.at(0);
        if (position > 0.2 && position < 0.8) between = position;
      });
  try {
    activate(node, "states");
    activate(node, "arm");
    move(node);
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
  for (int i = 0; i < 100 && position < 0.99; ++i) {
    rclcpp::spin_some(node);
    rclcpp::sleep_for(10ms);
  }
  std::printf("%s, and at %.2f\n", between > 0 ? "seen on its way" : "jumped", position);
}
