// The services interface of a node, which only refers to the base interface.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_SERVICES_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_SERVICES_INTERFACE_HPP_

#include <string>
#include <utility>

#include "rclcpp/client.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/service.hpp"

namespace rclcpp::node_interfaces {

/// Thread safety: immutable.
class NodeServicesInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeServicesInterface)
  explicit NodeServicesInterface(NodeBaseInterface::SharedPtr node) : node_(std::move(node)) {}
  const NodeBaseInterface::SharedPtr& get_node_base_interface() const { return node_; }
  std::string resolve_service_name(const std::string& name, bool only_expand = false) const {
    return node_->resolve_topic_or_service_name(name, true, only_expand);
  }

 private:
  const NodeBaseInterface::SharedPtr node_;
};

}  // namespace rclcpp::node_interfaces

#endif  // RCLCPP__NODE_INTERFACES__NODE_SERVICES_INTERFACE_HPP_
