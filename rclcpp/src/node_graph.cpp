// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <set>
#include <sstream>

#include "takt/programs/simulated_program.hpp"

#include "rclcpp/node_interfaces/node_graph_interface.hpp"

namespace rclcpp::node_interfaces {
namespace {

using Names = NodeGraphInterface::NamesAndTypes;
using Endpoints = std::vector<takt::GraphEndpoint>;

/// Names and types of all endpoints, or only of those of one node.
Names names_of(std::initializer_list<const Endpoints*> lists, const std::string& node = {}) {
  std::map<std::string, std::set<std::string>> types;  // untrusted input: any number of these
  for (const Endpoints* endpoints : lists) {
    for (const takt::GraphEndpoint& endpoint : *endpoints) {
      if (node.empty() || endpoint.node == node) types[endpoint.name].insert(endpoint.type);
    }
  }
  Names names;
  for (const auto& [name, of] : types) names[name].assign(of.begin(), of.end());
  return names;
}
Names of_node(const Endpoints& endpoints, const std::string& node, const std::string& name_space) {
  return names_of({&endpoints}, (name_space == "/" ? "" : name_space) + "/" + node);
}
std::size_t count(const Endpoints& endpoints, const std::string& name) {
  return static_cast<std::size_t>(std::count_if(
      endpoints.begin(), endpoints.end(), [&](const auto& known) { return known.name == name; }));
}
/// "/a/b" → "b", "/a"
std::pair<std::string, std::string> split(const std::string& full_name) {
  const auto slash = full_name.rfind('/');
  if (slash == std::string::npos) return {full_name, ""};
  return {full_name.substr(slash + 1), slash == 0 ? "/" : full_name.substr(0, slash)};
}
/// The type hash from its text "RIHS01_3f…"; unset when discovery does not know the hash.
rosidl_type_hash_t type_hash(const std::string& text) {
  rosidl_type_hash_t hash{};
  const auto digits = text.find('_') + 1;
  if (digits == 0) return hash;
  hash.version = 1;
  for (std::size_t i = 0; i < ROSIDL_TYPE_HASH_SIZE; ++i) {
    hash.value[i] =
        static_cast<std::uint8_t>(std::stoul(text.substr(digits + 2 * i, 2), nullptr, 16));
  }
  return hash;
}
std::vector<TopicEndpointInfo> infos(const Endpoints& endpoints, const std::string& topic,
                                     EndpointType kind) {
  std::vector<TopicEndpointInfo> result;
  for (const takt::GraphEndpoint& endpoint : endpoints) {
    if (endpoint.name != topic) continue;
    std::array<std::uint8_t, RMW_GID_STORAGE_SIZE> gid{};
    std::istringstream bytes(endpoint.gid);  // "01.10.…"
    std::string byte;
    for (std::size_t i = 0; i < gid.size() && std::getline(bytes, byte, '.'); ++i) {
      gid[i] = static_cast<std::uint8_t>(std::strtoul(byte.c_str(), nullptr, 16));
    }
    auto [name, name_space] = split(endpoint.node);
    result.emplace_back(std::move(name), std::move(name_space), endpoint.type, kind, gid,
                        QoS::from_takt(endpoint.qos), type_hash(endpoint.type_hash));
  }
  return result;
}

}  // namespace

takt::Graph NodeGraphInterface::graph() const {
  takt::programs::refuse("asks who else is there");
  return node_->takt_node()->participant()->graph();
}

Names NodeGraphInterface::get_topic_names_and_types(bool) const {
  const takt::Graph now = graph();
  return names_of({&now.publishers, &now.subscriptions});
}
Names NodeGraphInterface::get_service_names_and_types() const {
  const takt::Graph now = graph();
  return names_of({&now.services, &now.clients});
}
Names NodeGraphInterface::get_service_names_and_types_by_node(const std::string& node,
                                                              const std::string& name_space) const {
  return of_node(graph().services, node, name_space);
}
Names NodeGraphInterface::get_client_names_and_types_by_node(const std::string& node,
                                                             const std::string& name_space) const {
  return of_node(graph().clients, node, name_space);
}
Names NodeGraphInterface::get_publisher_names_and_types_by_node(const std::string& node,
                                                                const std::string& name_space,
                                                                bool) const {
  return of_node(graph().publishers, node, name_space);
}
Names NodeGraphInterface::get_subscriber_names_and_types_by_node(const std::string& node,
                                                                 const std::string& name_space,
                                                                 bool) const {
  return of_node(graph().subscriptions, node, name_space);
}
std::vector<std::string> NodeGraphInterface::get_node_names() const {
  return graph().nodes;
}
std::vector<std::pair<std::string, std::string>> NodeGraphInterface::get_node_names_and_namespaces()
    const {
  std::vector<std::pair<std::string, std::string>> names;
  for (const auto& node : graph().nodes) names.push_back(split(node));
  return names;
}
std::size_t NodeGraphInterface::count_publishers(const std::string& topic) const {
  return count(graph().publishers, node_->resolve_topic_or_service_name(topic, false));
}
std::size_t NodeGraphInterface::count_subscribers(const std::string& topic) const {
  return count(graph().subscriptions, node_->resolve_topic_or_service_name(topic, false));
}
std::size_t NodeGraphInterface::count_clients(const std::string& service) const {
  return count(graph().clients, node_->resolve_topic_or_service_name(service, true));
}
std::size_t NodeGraphInterface::count_services(const std::string& service) const {
  return count(graph().services, node_->resolve_topic_or_service_name(service, true));
}
std::vector<TopicEndpointInfo> NodeGraphInterface::get_publishers_info_by_topic(
    const std::string& topic, bool) const {
  return infos(graph().publishers, node_->resolve_topic_or_service_name(topic, false),
               EndpointType::Publisher);
}
std::vector<TopicEndpointInfo> NodeGraphInterface::get_subscriptions_info_by_topic(
    const std::string& topic, bool) const {
  return infos(graph().subscriptions, node_->resolve_topic_or_service_name(topic, false),
               EndpointType::Subscription);
}

}  // namespace rclcpp::node_interfaces
