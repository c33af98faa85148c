// What examples/23_workspace uses of tf2_ros, for tests without its source.
// SPDX-License-Identifier: Apache-2.0
#ifndef TF2_ROS_TRANSFORM_BROADCASTER_H_
#define TF2_ROS_TRANSFORM_BROADCASTER_H_

#include <geometry_msgs/msg/transform_stamped.hpp>
#include <rclcpp/rclcpp.hpp>
#include <tf2_msgs/msg/tf_message.hpp>

namespace tf2_ros {

class TransformBroadcaster {
 public:
  explicit TransformBroadcaster(rclcpp::Node& node)
      : transforms_(node.create_publisher<tf2_msgs::msg::TFMessage>("/tf", 100)) {}
  void sendTransform(const geometry_msgs::msg::TransformStamped& transform) {
    tf2_msgs::msg::TFMessage message;
    message.transforms.push_back(transform);
    transforms_->publish(message);
  }

 private:
  rclcpp::Publisher<tf2_msgs::msg::TFMessage>::SharedPtr transforms_;
};

}  // namespace tf2_ros

#endif  // TF2_ROS_TRANSFORM_BROADCASTER_H_
