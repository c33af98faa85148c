// Drives by a joystick: the driver of the joystick is ROS 2's, what has a deadline is here.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"
#include "takt/messages/geometry_msgs/msg/twist.hpp"
#include "takt/messages/sensor_msgs/msg/joy.hpp"

namespace demo {

class Drive : public takt::Node {
 public:
  explicit Drive(const takt::NodeOptions& options) : Node("drive", options) {
    speed_ = declare_parameter("speed", 0.5);
    publisher_ = create_publisher<geometry_msgs::msg::Twist>("cmd_vel", 10);
    subscription_ = create_subscription<sensor_msgs::msg::Joy>(
        "joy", 10, [this](const sensor_msgs::msg::Joy& joy) {
          if (joy.axes.size() < 2) return;
          command_.linear.x = speed_ * static_cast<double>(joy.axes[1]);
          command_.angular.z = static_cast<double>(joy.axes[0]);
        });
    timer_ = create_timer("control", std::chrono::milliseconds(1),
                          [this] { publisher_->publish(command_); });
  }
  ~Drive() override { publisher_->publish(geometry_msgs::msg::Twist()); }  // motors off

 private:
  double speed_ = 0;
  geometry_msgs::msg::Twist command_;
  std::shared_ptr<takt::Publisher<geometry_msgs::msg::Twist>> publisher_;
  std::shared_ptr<takt::Subscription<sensor_msgs::msg::Joy>> subscription_;
  std::shared_ptr<takt::Timer> timer_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Drive,
                        "turns a joystick's positions into commands, a thousand a second")
