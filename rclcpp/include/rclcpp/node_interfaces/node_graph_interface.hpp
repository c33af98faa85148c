// Queries of the ROS graph.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_GRAPH_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_GRAPH_INTERFACE_HPP_

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/qos.hpp"
#include "rosidl_runtime_c/type_hash.h"

namespace rclcpp {

enum class EndpointType { Invalid, Publisher, Subscription };

/// A publisher or a subscription of any process.
/// Thread safety: a value. Real-time: no.
class TopicEndpointInfo {
 public:
  TopicEndpointInfo(std::string node, std::string name_space, std::string type, EndpointType kind,
                    std::array<std::uint8_t, RMW_GID_STORAGE_SIZE> gid, QoS qos,
                    const rosidl_type_hash_t& type_hash)
      : node_(std::move(node)),
        name_space_(std::move(name_space)),
        type_(std::move(type)),
        kind_(kind),
        gid_(gid),
        qos_(std::move(qos)),
        type_hash_(type_hash) {}

  const std::string& node_name() const { return node_; }
  const std::string& node_namespace() const { return name_space_; }
  const std::string& topic_type() const { return type_; }
  EndpointType endpoint_type() const { return kind_; }
  const std::array<std::uint8_t, RMW_GID_STORAGE_SIZE>& endpoint_gid() const { return gid_; }
  const QoS& qos_profile() const { return qos_; }
  /// Version ROSIDL_TYPE_HASH_VERSION_UNSET: discovery does not know the type hash.
  const rosidl_type_hash_t& topic_type_hash() const { return type_hash_; }

 private:
  std::string node_, name_space_, type_;
  EndpointType kind_;
  std::array<std::uint8_t, RMW_GID_STORAGE_SIZE> gid_;
  QoS qos_;
  rosidl_type_hash_t type_hash_;
};

namespace node_interfaces {

/// Thread safety: every method from any thread. Real-time: no.
class NodeGraphInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeGraphInterface)
  using NamesAndTypes = std::map<std::string, std::vector<std::string>>;
  explicit NodeGraphInterface(NodeBaseInterface::SharedPtr node) : node_(std::move(node)) {}

  NamesAndTypes get_topic_names_and_types(bool no_demangle = false) const;
  NamesAndTypes get_service_names_and_types() const;
  NamesAndTypes get_service_names_and_types_by_node(const std::string& node,
                                                    const std::string& name_space) const;
  NamesAndTypes get_client_names_and_types_by_node(const std::string& node,
                                                   const std::string& name_space) const;
  NamesAndTypes get_publisher_names_and_types_by_node(const std::string& node,
                                                      const std::string& name_space,
                                                      bool no_demangle = false) const;
  NamesAndTypes get_subscriber_names_and_types_by_node(const std::string& node,
                                                       const std::string& name_space,
                                                       bool no_demangle = false) const;
  /// Fully qualified names.
  std::vector<std::string> get_node_names() const;
  std::vector<std::pair<std::string, std::string>> get_node_names_and_namespaces() const;
  std::size_t count_publishers(const std::string& topic) const;
  std::size_t count_subscribers(const std::string& topic) const;
  std::size_t count_clients(const std::string& service) const;
  std::size_t count_services(const std::string& service) const;
  std::vector<TopicEndpointInfo> get_publishers_info_by_topic(const std::string& topic,
                                                              bool no_mangle = false) const;
  std::vector<TopicEndpointInfo> get_subscriptions_info_by_topic(const std::string& topic,
                                                                 bool no_mangle = false) const;

 private:
  takt::Graph graph() const;
  const NodeBaseInterface::SharedPtr node_;
};

}  // namespace node_interfaces
}  // namespace rclcpp

#endif  // RCLCPP__NODE_INTERFACES__NODE_GRAPH_INTERFACE_HPP_
