// ros2_control's loop as a callback, where ros2_control_node has a thread of its own: a file of
// Takt's says which thread runs it, with which priority and deadline.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "controller_manager/controller_manager.hpp"
#include "rclcpp/rclcpp.hpp"

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  auto options = controller_manager::get_cm_node_options();
  options.arguments(std::vector<std::string>(argv + 1, argv + argc));  // what controllers get, too
  const auto executor = std::make_shared<rclcpp::executors::MultiThreadedExecutor>();
  const auto manager = std::make_shared<controller_manager::ControllerManager>(
      executor, "controller_manager", "", options);
  rclcpp::Time previous = manager->get_trigger_clock()->now();
  const auto timer = manager->create_wall_timer(
      std::chrono::nanoseconds(1'000'000'000 / manager->get_update_rate()),
      [&] {
        const rclcpp::Time now = manager->get_trigger_clock()->now();
        const rclcpp::Duration period = now - previous;
        previous = now;
        manager->read(now, period);
        manager->update(now, period);
        manager->write(now, period);
      },
      manager->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
  executor->add_node(manager);
  executor->spin();
}
