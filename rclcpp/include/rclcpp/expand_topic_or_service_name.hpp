// Full names of topics and services.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_
#define RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_

#include <string>

namespace rclcpp {

/// Applies no remap rules. Throws exceptions::InvalidTopicNameError or InvalidServiceNameError.
std::string expand_topic_or_service_name(const std::string& name, const std::string& node_name,
                                         const std::string& name_space, bool is_service = false);

}  // namespace rclcpp

#endif  // RCLCPP__EXPAND_TOPIC_OR_SERVICE_NAME_HPP_
