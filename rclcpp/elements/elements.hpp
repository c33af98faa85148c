// Types that the checks of rclcpp's elements share.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ELEMENTS_ELEMENTS_HPP_
#define RCLCPP_ELEMENTS_ELEMENTS_HPP_

#include "example_interfaces/action/fibonacci.hpp"
#include "example_interfaces/srv/add_two_ints.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_action/rclcpp_action.hpp"
#include "rclcpp_lifecycle/lifecycle_node.hpp"
#include "std_msgs/msg/string.hpp"

/// A type of a program's own, sent as a message.
template <>
struct rclcpp::TypeAdapter<std::string, std_msgs::msg::String> {
  using is_specialized = std::true_type;
  using custom_type = std::string;
  using ros_message_type = std_msgs::msg::String;
  static void convert_to_ros_message(const custom_type& from, ros_message_type& to) {
    to.data = from;
  }
  static void convert_to_custom(const ros_message_type& from, custom_type& to) { to = from.data; }
};

namespace rclcpp::elements {
using example_interfaces::action::Fibonacci;
using example_interfaces::srv::AddTwoInts;
using std_msgs::msg::String;
}  // namespace rclcpp::elements

#endif  // RCLCPP_ELEMENTS_ELEMENTS_HPP_
