// ROS 2's services for loading components at run time, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_COMPOSITION_INTERFACES_HPP_
#define TAKT_MESSAGES_PACKAGES_COMPOSITION_INTERFACES_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/packages/rcl_interfaces.hpp"

namespace takt::composition_interfaces {

struct LoadNode {
  struct Request {
    std::string package_name, plugin_name, node_name, node_namespace;
    std::uint8_t log_level = 0;            // 0: as it is; else 10, 20, … as in rcl_interfaces/Log
    std::vector<std::string> remap_rules;  // "from:=to"
    std::vector<rcl_interfaces::Parameter> parameters, extra_arguments;
  };
  struct Response {
    bool success = false;
    std::string error_message, full_node_name;
    std::uint64_t unique_id = 0;
  };
};
TAKT_MESSAGE(LoadNode::Request, "composition_interfaces/srv/LoadNode_Request", package_name,
             plugin_name, node_name, node_namespace, log_level, remap_rules, parameters,
             extra_arguments);
TAKT_MESSAGE(LoadNode::Response, "composition_interfaces/srv/LoadNode_Response", success,
             error_message, full_node_name, unique_id);

struct UnloadNode {
  struct Request {
    std::uint64_t unique_id = 0;
  };
  struct Response {
    bool success = false;
    std::string error_message;
  };
};
TAKT_MESSAGE(UnloadNode::Request, "composition_interfaces/srv/UnloadNode_Request", unique_id);
TAKT_MESSAGE(UnloadNode::Response, "composition_interfaces/srv/UnloadNode_Response", success,
             error_message);

struct ListNodes {
  struct Request {};
  struct Response {
    std::vector<std::string> full_node_names;
    std::vector<std::uint64_t> unique_ids;
  };
};
TAKT_MESSAGE(ListNodes::Request, "composition_interfaces/srv/ListNodes_Request");
TAKT_MESSAGE(ListNodes::Response, "composition_interfaces/srv/ListNodes_Response", full_node_names,
             unique_ids);

}  // namespace takt::composition_interfaces

#endif  // TAKT_MESSAGES_PACKAGES_COMPOSITION_INTERFACES_HPP_
