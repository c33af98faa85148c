// images send URL: images with the calibration of that file; images receive: until ten have come.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>

#include "camera_info_manager/camera_info_manager.hpp"
#include "image_transport/image_transport.hpp"
#include "rclcpp/rclcpp.hpp"

namespace {

void send(const rclcpp::Node::SharedPtr& node, const std::string& url) {
  camera_info_manager::CameraInfoManager calibration(node.get(), "camera", url);
  auto publisher = image_transport::create_camera_publisher(node.get(), "camera/image");
  const auto timer = node->create_wall_timer(std::chrono::milliseconds(20), [&] {
    sensor_msgs::msg::Image image;
    image.header.stamp = node->now();
    image.width = image.step = 4;
    image.height = 2;
    image.encoding = "mono8";
    image.data.assign(8, 7);
    auto information = calibration.getCameraInfo();
    information.header = image.header;
    publisher.publish(image, information);
  });
  rclcpp::spin(node);
}

void receive(const rclcpp::Node::SharedPtr& node) {
  int images = 0;
  const auto subscriber = image_transport::create_camera_subscription(
      node.get(), "camera/image",
      [&](const sensor_msgs::msg::Image::ConstSharedPtr& image,
          const sensor_msgs::msg::CameraInfo::ConstSharedPtr& information) {
        if (++images != 10) return;
        std::printf("%u x %u, fx %.1f\n", image->width, image->height, information->k[0]);
        rclcpp::shutdown();
      },
      "raw");
  rclcpp::spin(node);
}

}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const bool sends = argc > 2;
  const auto node = std::make_shared<rclcpp::Node>(sends ? "sender" : "receiver");
  sends ? send(node, argv[2]) : receive(node);
}
