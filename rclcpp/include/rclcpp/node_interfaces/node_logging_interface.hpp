// The logger of a node, and its publisher of /rosout.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_LOGGING_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_LOGGING_INTERFACE_HPP_

#include <memory>

#include "rclcpp/logger.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"

namespace rclcpp::node_interfaces {

/// Thread safety: every method from any thread. Real-time: yes.
class NodeLoggingInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeLoggingInterface)
  explicit NodeLoggingInterface(NodeBaseInterface& node);
  ~NodeLoggingInterface();
  NodeLoggingInterface(const NodeLoggingInterface&) = delete;
  NodeLoggingInterface& operator=(const NodeLoggingInterface&) = delete;

  Logger get_logger() const { return logger_; }
  const char* get_logger_name() const { return logger_.get_name(); }

 private:
  const Logger logger_;
  const bool has_rosout_;
  std::shared_ptr<takt::Entity> get_levels_, set_levels_;  // services
};

}  // namespace rclcpp::node_interfaces

#endif  // RCLCPP__NODE_INTERFACES__NODE_LOGGING_INTERFACE_HPP_
