// The factory of one class of nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_COMPONENTS__NODE_FACTORY_TEMPLATE_HPP_
#define RCLCPP_COMPONENTS__NODE_FACTORY_TEMPLATE_HPP_

#include <memory>

#include "rclcpp_components/node_factory.hpp"

namespace rclcpp_components {

/// For any class that has get_node_base_interface() and a constructor from NodeOptions.
/// Thread safety: from any thread. Real-time: set-up only.
template <class NodeT>
class NodeFactoryTemplate : public NodeFactory {
 public:
  NodeInstanceWrapper create_node_instance(const rclcpp::NodeOptions& options) override {
    return {std::make_shared<NodeT>(options), [](const std::shared_ptr<void>& node) {
              return std::static_pointer_cast<NodeT>(node)->get_node_base_interface();
            }};
  }
};

}  // namespace rclcpp_components

#endif  // RCLCPP_COMPONENTS__NODE_FACTORY_TEMPLATE_HPP_
