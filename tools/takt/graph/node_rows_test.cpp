// SPDX-License-Identifier: Apache-2.0
#include "graph/node_rows.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

// A graph as large as one is read: each node was compared with each endpoint, 4 milliard times.
TEST(NodeRows, CountTheEndsOfAsManyNodesAsThereCanBe) {
  constexpr std::size_t kNodes = 10'000, kEndsOfEach = 10;
  Graph graph;
  for (std::size_t i = 0; i < kNodes; ++i) {
    graph.nodes.push_back(fmt::format("/a_name_that_begins_as_all_others_do/n{:05}", i));
    for (std::size_t k = 0; k < kEndsOfEach; ++k) {
      for (auto* ends : {&graph.publishers, &graph.subscriptions, &graph.services}) {
        ends->push_back({.name = "/x", .node = graph.nodes.back()});
      }
    }
  }
  graph.publishers.push_back({.name = "/x", .node = ""});
  graph.clients.push_back({.name = "/x", .node = graph.nodes[7]});
  const auto rows = node_rows(graph, [](const std::string&) { return true; });
  ASSERT_EQ(rows.size(), kNodes);
  for (std::size_t i = 0; i < kNodes; ++i) {
    ASSERT_EQ(rows[i].node, graph.nodes[i]);
    ASSERT_EQ(rows[i].publishers, kEndsOfEach);
    ASSERT_EQ(rows[i].subscriptions, kEndsOfEach);
    ASSERT_EQ(rows[i].services, kEndsOfEach);
    ASSERT_EQ(rows[i].clients, i == 7 ? 1u : 0u);
  }
}

TEST(NodeRows, LeaveOutWhatIsNotShown) {
  const Graph graph{.nodes = {"/_hidden", "/shown"}};
  const auto rows = node_rows(graph, [](const std::string& node) { return node != "/_hidden"; });
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].node, "/shown");
}

}  // namespace
}  // namespace takt::tools
