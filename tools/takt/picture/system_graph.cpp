// SPDX-License-Identifier: Apache-2.0
#include "picture/system_graph.hpp"

#include <map>
#include <utility>

#include "takt/containers/container.hpp"
#include "takt/containers/one_sided_topics.hpp"
#include "takt/transport/local_topics.hpp"

#include "picture/graph_parts.hpp"
#include "run/constructor_exit.hpp"

namespace takt::tools {
namespace {

void add_process(SystemDescription process, GraphParts& parts) {
  process.dds.reset();  // nothing runs
  const std::string name = process.name;
  const LocalTopics before = local_topics();  // an analysis has nodes of the same file, too
  const Container container(process, reports_exit());
  parts.processes.push_back({structure_of(container)});
  const auto add = [&](const std::vector<Endpoint>& from, const std::vector<Endpoint>& others,
                       std::vector<GraphParts::End>& to) {
    std::map<std::pair<std::string, std::string>, int> of_others;
    for (const Endpoint& end : others) ++of_others[{end.topic, end.node}];
    for (const Endpoint& end : from) {
      if (!end.topic.starts_with('/') || is_everywhere(end.topic)) continue;
      if (of_others[{end.topic, end.node}]-- > 0) continue;
      to.push_back({name, end.node, end.topic, end.type->name, end.qos});
    }
  };
  const LocalTopics here = local_topics();
  add(here.publishers, before.publishers, parts.publishers);
  add(here.subscriptions, before.subscriptions, parts.subscriptions);
}

}  // namespace

nlohmann::json system_graph(const std::string& file) {
  GraphParts parts;
  for (const SystemDescription& process : split(read_system(file), Composition::file)) {
    add_process(process, parts);
  }
  nlohmann::json graph = graph_json(file, parts);
  graph["file"] = file;
  return graph;
}

}  // namespace takt::tools
