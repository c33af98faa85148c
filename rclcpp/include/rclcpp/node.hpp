// Nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_HPP_
#define RCLCPP__NODE_HPP_

#include <memory>
#include <string>

#include "rclcpp/detail/node_api.hpp"
#include "rclcpp/logging.hpp"
#include "rclcpp/utilities.hpp"  // programs that include node.hpp alone call ok()

namespace rclcpp {

/// Takt's node behind the interface of rclcpp's.
/// Thread safety and real-time: as detail::NodeApi.
class Node : public detail::NodeApi, public std::enable_shared_from_this<Node> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Node)

  explicit Node(const std::string& name, const NodeOptions& options = NodeOptions())
      : Node(name, "", options) {}
  explicit Node(const std::string& name, const std::string& name_space,
                const NodeOptions& options = NodeOptions());
  virtual ~Node();

  template <class M, class Allocator = std::allocator<void>, class P = Publisher<M, Allocator>>
  std::shared_ptr<P> create_publisher(
      const std::string& topic, const QoS& qos,
      const PublisherOptionsWithAllocator<Allocator>& options = {}) {
    return rclcpp::create_publisher<M, Allocator, P>(
        get_node_parameters_interface(), get_node_base_interface(), in_sub(topic), qos, options);
  }
  /// The same node, but relative names get this namespace as a prefix.
  SharedPtr create_sub_node(const std::string& name_space);

 protected:
  Node(const Node& other, const std::string& sub_namespace) : NodeApi(other, sub_namespace) {}
};

}  // namespace rclcpp

#endif  // RCLCPP__NODE_HPP_
