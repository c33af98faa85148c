// The processes and topics of a system, from which the JSON of its picture is made.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_GRAPH_PARTS_HPP_
#define TAKT_TOOLS_TAKT_GRAPH_PARTS_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/structure.hpp"
#include "takt/transport/qos.hpp"

namespace takt::tools {

struct GraphParts {
  struct Process {
    ContainerStructure structure;
    bool is_container = true;  // false: another program, of which only the nodes are known
  };
  /// A publisher or subscription.
  struct End {
    std::string process, node, topic, type;
    QoS qos;
  };
  std::vector<Process> processes;
  std::vector<End> publishers, subscriptions;
};

/// "title", "processes" (with "executors" and "nodes"), "topics" (with "publishers",
/// "subscriptions" and "mismatches") and "chains".
nlohmann::json graph_json(const std::string& title, const GraphParts& parts);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_GRAPH_PARTS_HPP_
