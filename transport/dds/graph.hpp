// ROS 2's graph: the nodes on a domain, with their topics and services.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_GRAPH_HPP_
#define TAKT_TRANSPORT_DDS_GRAPH_HPP_

#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// The form in which a process announces its nodes. Others see its topics and services anyway.
enum class RosGraph {
  off,     // it announces none, and sees no names of nodes
  humble,  // ROS 2 up to Humble: no type hashes
  jazzy,   // since Iron
};

/// A publisher, subscription, client or service of any process on the domain.
struct GraphEndpoint {
  std::string name;  // "/scan"; a service's too: "/add"
  std::string type;  // "sensor_msgs/msg/LaserScan", "example_interfaces/srv/AddTwoInts"
  std::string node;  // its full name; empty when unknown
  /// Empty when unknown. ROS 2 announces none of a service, but those of its request and response:
  /// this is then the request's.
  std::string type_hash;
  std::string response_hash;
  std::string gid;  // as ROS 2 shows it: "01.10.…", 16 bytes
  QoS qos;          // of publishers and subscriptions
};

/// The discovered graph, sorted by name.
struct Graph {
  std::vector<std::string> nodes;
  std::vector<GraphEndpoint> publishers, subscriptions, services, clients;
};

/// The keys of such ids.
inline constexpr char kServiceId[] = "serviceid", kClientId[] = "clientid";

/// "serviceid=1f.3a...;": an id that no other service or client has, for user data.
std::string new_service_id(std::string_view kind);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_GRAPH_HPP_
