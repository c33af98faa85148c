// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "arguments.hpp"
#include "rclcpp/node_interfaces/node_logging_interface.hpp"
#include "rosout.hpp"

namespace rclcpp::node_interfaces {
namespace {

/// "/front/camera" → "front.camera"
std::string logger_name(const takt::Node& node) {
  std::string name = node.fully_qualified_name().substr(1);
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

}  // namespace

NodeLoggingInterface::NodeLoggingInterface(NodeBaseInterface& node)
    : logger_(rclcpp::get_logger(logger_name(*node.takt_node()))),
      has_rosout_(node.options().enable_rosout() && node.get_context()->arguments().rosout) {
  if (!has_rosout_) return;
  detail::add_rosout(logger_.get_name(),
                     node.takt_node()->create_publisher<rcl_interfaces::msg::Log>(
                         "/rosout", node.options().rosout_qos().to_takt(false)));
}
NodeLoggingInterface::~NodeLoggingInterface() {
  if (has_rosout_) detail::remove_rosout(logger_.get_name());
}

}  // namespace rclcpp::node_interfaces
