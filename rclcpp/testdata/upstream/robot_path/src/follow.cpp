// A robot that does what the controller server says, and asks it to follow a path of 1 m.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "geometry_msgs/msg/twist.hpp"
#include "nav2_msgs/action/follow_path.hpp"
#include "nav_msgs/msg/odometry.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_action/rclcpp_action.hpp"
#include "tf2_ros/transform_broadcaster.h"

using FollowPath = nav2_msgs::action::FollowPath;

namespace {

FollowPath::Goal path_of_one_metre(const rclcpp::Time& now) {
  FollowPath::Goal goal;
  goal.controller_id = "FollowPath";
  goal.path.header.stamp = now;
  goal.path.header.frame_id = "odom";
  for (int i = 0; i <= 20; ++i) {
    geometry_msgs::msg::PoseStamped pose;
    pose.header = goal.path.header;
    pose.pose.position.x = 0.05 * i;
    pose.pose.orientation.w = 1;
    goal.path.poses.push_back(pose);
  }
  return goal;
}

}  // namespace

int main(int argc, char* argv[]) {
  using namespace std::chrono_literals;
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("follow");
  tf2_ros::TransformBroadcaster broadcaster(node);
  const auto odometry = node->create_publisher<nav_msgs::msg::Odometry>("odom", 10);
  geometry_msgs::msg::Twist speed;
  const auto commands = node->create_subscription<geometry_msgs::msg::Twist>(
      "cmd_vel", 10, [&](const geometry_msgs::msg::Twist& command) { speed = command; });
  double x = 0, y = 0, heading = 0;
  const auto wheels = node->create_wall_timer(20ms, [&] {
    x += 0.02 * speed.linear.x * std::cos(heading);
    y += 0.02 * speed.linear.x * std::sin(heading);
    heading += 0.02 * speed.angular.z;
    geometry_msgs::msg::TransformStamped place;
    place.header.stamp = node->now();
    place.header.frame_id = "odom";
    place.child_frame_id = "base_link";
    place.transform.translation.x = x;
    place.transform.translation.y = y;
    place.transform.rotation.z = std::sin(heading / 2);
    place.transform.rotation.w = std::cos(heading / 2);
    broadcaster.sendTransform(place);
    nav_msgs::msg::Odometry moved;
    moved.header = place.header;
    moved.child_frame_id = place.child_frame_id;
    moved.twist.twist = speed;
    odometry->publish(moved);
  });
  const auto client = rclcpp_action::create_client<FollowPath>(node, "follow_path");
  rclcpp_action::Client<FollowPath>::SendGoalOptions options;
  bool is_asked = false;
  options.goal_response_callback = [&](const auto& handle) {
    if (handle == nullptr) is_asked = false;  // the server is not active yet
  };
  options.result_callback = [&](const auto& result) {
    std::printf("error code %d, %s\n", static_cast<int>(result.result->error_code),
                std::hypot(x - 1, y) < 0.2 ? "at its end" : "elsewhere");
    std::fflush(stdout);
    rclcpp::shutdown();
  };
  const auto asking = node->create_wall_timer(500ms, [&] {
    if (is_asked || !client->action_server_is_ready()) return;
    is_asked = true;
    client->async_send_goal(path_of_one_metre(node->now()), options);
  });
  rclcpp::spin(node);
}
