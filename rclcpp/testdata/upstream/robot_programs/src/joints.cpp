// The state of a joint, fifty times a second, by a publisher for real-time loops.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>

#include "rclcpp/rclcpp.hpp"
#include "realtime_tools/realtime_publisher.hpp"
#include "sensor_msgs/msg/joint_state.hpp"

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("joints");
  realtime_tools::RealtimePublisher<sensor_msgs::msg::JointState> publisher(
      node->create_publisher<sensor_msgs::msg::JointState>("joint_states", 10));
  const auto timer = node->create_wall_timer(std::chrono::milliseconds(20), [&] {
    sensor_msgs::msg::JointState state;
    state.header.stamp = node->now();
    state.name = {"turn"};
    state.position = {1.5707963267948966};
    publisher.try_publish(state);
  });
  rclcpp::spin(node);
}
