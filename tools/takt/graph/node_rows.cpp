// SPDX-License-Identifier: Apache-2.0
#include "graph/node_rows.hpp"

#include <string_view>
#include <unordered_map>

namespace takt::tools {

std::vector<NodeRow> node_rows(const Graph& graph,
                               const std::function<bool(const std::string&)>& is_shown) {
  std::unordered_map<std::string_view, NodeRow> counts;
  const auto count = [&](const std::vector<GraphEndpoint>& ends, std::size_t NodeRow::*kind) {
    for (const GraphEndpoint& end : ends) ++(counts[end.node].*kind);
  };
  count(graph.publishers, &NodeRow::publishers);
  count(graph.subscriptions, &NodeRow::subscriptions);
  count(graph.services, &NodeRow::services);
  count(graph.clients, &NodeRow::clients);
  std::vector<NodeRow> rows;
  for (const std::string& node : graph.nodes) {
    if (!is_shown(node)) continue;
    rows.push_back(counts[node]);
    rows.back().node = node;
  }
  return rows;
}

}  // namespace takt::tools
