// A system as a picture shows it: processes, executors, nodes, topics and chains, as JSON.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_
#define TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Constructs the components of the file's processes, one after another, without network: nothing
/// runs. Returns "processes" (with "executors" and "nodes"), "topics" (with "publishers",
/// "subscriptions" and "mismatches") and "chains". Topics that every node has are left out.
/// Throws Error as Container does.
nlohmann::json system_graph(const std::string& file);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_
