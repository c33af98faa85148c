// The /rosout publishers of loggers.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ROSOUT_HPP_
#define RCLCPP_ROSOUT_HPP_

#include <memory>
#include <string>

#include "takt/entities/publisher.hpp"
#include "takt/messages/rcl_interfaces/msg/log.hpp"

namespace rclcpp::detail {

using RosoutPublisher = takt::Publisher<rcl_interfaces::msg::Log>;
/// From now on, lines of this logger and of its children also go to this publisher.
void add_rosout(const std::string& logger, std::shared_ptr<RosoutPublisher> publisher);
void remove_rosout(const std::string& logger);

}  // namespace rclcpp::detail

#endif  // RCLCPP_ROSOUT_HPP_
