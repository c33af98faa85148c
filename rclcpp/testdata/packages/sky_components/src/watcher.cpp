// A component that publishes until it has received something, and then ends the program.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>

#include "rclcpp/rclcpp.hpp"
#include "rclcpp_components/register_node_macro.hpp"
#include "rclcpp_lifecycle/visibility_control.h"  // which some packages include beside their own
#include "sky_interfaces/msg/sky.hpp"

namespace sky_components {

class Watcher : public rclcpp::Node {
 public:
  explicit Watcher(const rclcpp::NodeOptions& options) : Node("watcher", options) {
    publisher_ = create_publisher<sky_interfaces::msg::Sky>("sky", 10);
    subscription_ = create_subscription<sky_interfaces::msg::Sky>(
        "sky", 10, [this](sky_interfaces::msg::Sky::ConstSharedPtr sky) {
          RCLCPP_INFO(get_logger(), "it has %zu clouds", sky->clouds.size());
          rclcpp::shutdown();
        });
    timer_ = create_wall_timer(std::chrono::milliseconds(20), [=] {
      auto sky = std::make_unique<sky_interfaces::msg::Sky>();
      sky->clouds.resize(lround(3.0));  // of <math.h>, which packages have from rclcpp.hpp
      publisher_->publish(std::move(sky));
    });
  }

 private:
  rclcpp::Publisher<sky_interfaces::msg::Sky>::SharedPtr publisher_;
  rclcpp::Subscription<sky_interfaces::msg::Sky>::SharedPtr subscription_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace sky_components

RCLCPP_COMPONENTS_REGISTER_NODE(sky_components::Watcher)
