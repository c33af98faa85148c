// takt node: shows the nodes on the domain.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/node_rows.hpp"
#include "graph/observer.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::node_command {
namespace {

using nlohmann::json;

struct Options : ObserverOptions {
  std::string node;
};

void list(const Options& options) {
  const auto is_shown = [&](const std::string& node) { return options.all || !is_hidden(node); };
  const Graph graph = Observer(options).whole_graph([&](const Graph& seen) {
    return std::any_of(seen.nodes.begin(), seen.nodes.end(), is_shown);
  });
  Table table({"node", "publishers", "subscriptions", "services", "clients"});
  json rows = json::array();
  for (const NodeRow& row : node_rows(graph, is_shown)) {
    table.add({row.node, std::to_string(row.publishers), std::to_string(row.subscriptions),
               std::to_string(row.services), std::to_string(row.clients)});
    rows.push_back({{"node", row.node},
                    {"publishers", row.publishers},
                    {"subscriptions", row.subscriptions},
                    {"services", row.services},
                    {"clients", row.clients}});
  }
  if (rows.empty()) rt::to_stderr("no node on DDS domain {}\n", options.domain.number());
  if (options.json_path != "-") table.print("nodes");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void info(const Options& options) {
  const std::string name = absolute(options.node);
  const Graph graph = Observer(options).whole_graph([&](const Graph& seen) {
    return std::find(seen.nodes.begin(), seen.nodes.end(), name) != seen.nodes.end();
  });
  if (std::find(graph.nodes.begin(), graph.nodes.end(), name) == graph.nodes.end()) {
    throw Error(fmt::format("there is no node '{}'", name),
                graph.nodes.empty() ? "no node was discovered on this DDS domain"
                                    : suggest(name, graph.nodes));
  }
  json result = {{"node", name}};
  for (const auto& [title, list] : {std::pair("publishers", &graph.publishers),
                                    {"subscriptions", &graph.subscriptions},
                                    {"services", &graph.services},
                                    {"clients", &graph.clients}}) {
    Table table({"name", "type"});
    json rows = json::array();
    for (const GraphEndpoint& endpoint : *list) {
      if (endpoint.node != name) continue;
      table.add({endpoint.name, endpoint.type});
      rows.push_back({{"name", endpoint.name}, {"type", endpoint.type}});
    }
    if (options.json_path != "-") table.print(title);
    result[title] = std::move(rows);
  }
  if (!options.json_path.empty()) write_json(result, options.json_path);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  CLI::App* list_command = command->add_subcommand("list", "Lists all nodes");
  add_observer_options(*list_command, *options);
  list_command->add_flag("-a,--all", options->all,
                         "Include hidden nodes, whose names begin with '_'");
  list_command->callback([options] { list(*options); });
  CLI::App* info_command =
      command->add_subcommand("info", "Shows the topics and services of a node");
  add_observer_options(*info_command, *options);
  info_command->add_option("NODE", options->node, "Its name, with its namespace")->required();
  info_command->callback([options] { info(*options); });
  command->footer(
      "Example:\n"
      "  takt node list\n"
      "  takt node info /front/lidar\n");
}
const Command registered("node", "Shows the nodes on a DDS domain, including ROS 2's", set_up);

}  // namespace
}  // namespace takt::tools::node_command
