// The rover's base, here a simulated one: it drives as fast as the last command says, and says
// where it is.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>

#include <diagnostic_updater/diagnostic_updater.hpp>
#include <geometry_msgs/msg/transform_stamped.hpp>
#include <geometry_msgs/msg/twist.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <rover_msgs/msg/travel.hpp>
#include <tf2_ros/transform_broadcaster.h>

namespace rover_driver {

class Driver : public rclcpp::Node {
 public:
  explicit Driver(const rclcpp::NodeOptions& options)
      : Node("driver", options), broadcaster_(*this), updater_(this) {
    travels_ = create_publisher<rover_msgs::msg::Travel>("travel", 10);
    commands_ = create_subscription<geometry_msgs::msg::Twist>(
        "cmd_vel", 10, [this](const geometry_msgs::msg::Twist& command) {
          travel_.speed = command.linear.x;
          commanded_ = now();
        });
    timer_ = create_wall_timer(kPeriod, [this] { drive(); });
    updater_.setHardwareID("rover");
    updater_.add("base", this, &Driver::diagnose);
  }

 private:
  static constexpr std::chrono::milliseconds kPeriod{10};

  void drive() {
    if ((now() - commanded_).seconds() > 0.5) travel_.speed = 0;  // nobody drives it any more
    travel_.distance += travel_.speed * std::chrono::duration<double>(kPeriod).count();
    travel_.stamp = now();
    travels_->publish(travel_);
    geometry_msgs::msg::TransformStamped transform;
    transform.header.stamp = travel_.stamp;
    transform.header.frame_id = "odom";
    transform.child_frame_id = "base_link";
    transform.transform.translation.x = travel_.distance;
    transform.transform.rotation.w = 1;
    broadcaster_.sendTransform(transform);
  }

  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
    if (travel_.speed == 0) {
      status.summary(diagnostic_msgs::msg::DiagnosticStatus::OK, "it stands");
    } else {
      status.summary(diagnostic_msgs::msg::DiagnosticStatus::OK, "it drives");
    }
    status.add("distance", travel_.distance);
  }

  rover_msgs::msg::Travel travel_;
  rclcpp::Time commanded_{0, 0, RCL_ROS_TIME};
  tf2_ros::TransformBroadcaster broadcaster_;
  diagnostic_updater::Updater updater_;
  rclcpp::Publisher<rover_msgs::msg::Travel>::SharedPtr travels_;
  rclcpp::Subscription<geometry_msgs::msg::Twist>::SharedPtr commands_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace rover_driver

RCLCPP_COMPONENTS_REGISTER_NODE(rover_driver::Driver)
