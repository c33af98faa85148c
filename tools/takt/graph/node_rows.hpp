// How many endpoints of each kind the nodes of a domain have.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_NODE_ROWS_HPP_
#define TAKT_TOOLS_TAKT_NODE_ROWS_HPP_

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "takt/transport/dds/graph.hpp"

namespace takt::tools {

struct NodeRow {
  std::string node;
  std::size_t publishers = 0, subscriptions = 0, services = 0, clients = 0;
};

/// A row for each node of the graph that is shown, in its order. Others say how many nodes and
/// endpoints there are: each is looked up, none is compared with all.
std::vector<NodeRow> node_rows(const Graph& graph,
                               const std::function<bool(const std::string&)>& is_shown);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_NODE_ROWS_HPP_
