// A robot whose wheels say 0.5 m/s and whose IMU says that it turns: until the estimate of both is
// there, as a message and as a transform.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "nav_msgs/msg/odometry.hpp"
#include "rclcpp/rclcpp.hpp"
#include "sensor_msgs/msg/imu.hpp"
#include "tf2_ros/buffer.h"
#include "tf2_ros/transform_listener.h"

int main(int argc, char* argv[]) {
  using namespace std::chrono_literals;
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("drive");
  tf2_ros::Buffer buffer(node->get_clock());
  const tf2_ros::TransformListener listener(buffer, node);
  const auto wheels = node->create_publisher<nav_msgs::msg::Odometry>("odom", 10);
  const auto imu = node->create_publisher<sensor_msgs::msg::Imu>("imu", 10);
  const auto timer = node->create_wall_timer(20ms, [&] {
    nav_msgs::msg::Odometry speed;
    speed.header.stamp = node->now();
    speed.header.frame_id = "odom";
    speed.child_frame_id = "base_link";
    speed.twist.twist.linear.x = 0.5;
    speed.twist.covariance[0] = 0.01;
    wheels->publish(speed);
    sensor_msgs::msg::Imu turn;
    turn.header.stamp = speed.header.stamp;
    turn.header.frame_id = "base_link";
    turn.angular_velocity.z = 0.2;
    turn.angular_velocity_covariance[8] = 0.01;
    imu->publish(turn);
  });
  const auto estimate = node->create_subscription<nav_msgs::msg::Odometry>(
      "odometry/filtered", 10, [&](const nav_msgs::msg::Odometry& filtered) {
        const auto& twist = filtered.twist.twist;
        if (std::abs(twist.linear.x - 0.5) > 0.05 || std::abs(twist.angular.z - 0.2) > 0.02 ||
            filtered.pose.pose.position.x < 0.3 ||
            !buffer.canTransform("odom", "base_link", tf2::TimePointZero)) {
          return;
        }
        const auto place = buffer.lookupTransform("odom", "base_link", tf2::TimePointZero);
        const bool is_near =
            std::abs(place.transform.translation.x - filtered.pose.pose.position.x) < 0.1;
        std::printf("%.1f m/s, %.1f rad/s, its transform is %s\n", twist.linear.x, twist.angular.z,
                    is_near ? "near" : "far");
        std::fflush(stdout);
        rclcpp::shutdown();
      });
  rclcpp::spin(node);
}
