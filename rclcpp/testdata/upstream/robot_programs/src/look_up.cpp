// Where a point of one frame is in another: look_up TARGET SOURCE.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "geometry_msgs/msg/point_stamped.hpp"
#include "rclcpp/rclcpp.hpp"
#include "tf2_eigen/tf2_eigen.hpp"
#include "tf2_geometry_msgs/tf2_geometry_msgs.hpp"
#include "tf2_ros/buffer.h"
#include "tf2_ros/transform_listener.h"

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("look_up");
  tf2_ros::Buffer buffer(node->get_clock());
  const tf2_ros::TransformListener listener(buffer);
  const auto transform =
      buffer.lookupTransform(argv[1], argv[2], tf2::TimePointZero, tf2::durationFromSec(10));
  geometry_msgs::msg::PointStamped point;
  point.header.frame_id = argv[2];
  point.point.x = 1;
  const auto there = buffer.transform(point, argv[1]).point;
  const Eigen::Vector3d same = tf2::transformToEigen(transform) * Eigen::Vector3d(1, 0, 0);
  std::printf("%.2f %.2f %.2f\n%.2f %.2f %.2f\n", there.x, there.y, there.z, same.x(), same.y(),
              same.z());
  rclcpp::shutdown();
}
