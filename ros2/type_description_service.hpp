// ROS 2's service that describes the types of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_TYPE_DESCRIPTION_SERVICE_HPP_
#define TAKT_ROS2_TYPE_DESCRIPTION_SERVICE_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/messages/type_description_interfaces/srv/get_type_description.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Serves `get_type_description` under the full name of a node: other nodes ask for types that they
/// have not compiled in, by the name and type hash that the node's topics, services and actions
/// announce. The service knows the types of all endpoints of the node's participant. It reports the
/// names of sources, without contents: programs contain none.
///
/// The service is an entity of the host, in its default callback group, as those of
/// ParameterServices; in ROS 2's graph it belongs to the node. Both nodes have the same
/// participant, and must outlive this object.
/// Source: REP 2016.
///
/// Thread safety: as Node.
/// Real-time: no; it computes descriptions and hashes.
class TypeDescriptionService {
 public:
  TypeDescriptionService(const Node& node, Node& host);

 private:
  const std::shared_ptr<Service<type_description_interfaces::srv::GetTypeDescription>> service_;
};

}  // namespace takt

#endif  // TAKT_ROS2_TYPE_DESCRIPTION_SERVICE_HPP_
