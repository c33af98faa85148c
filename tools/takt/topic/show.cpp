// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "takt/measuring/output.hpp"

#include "run/result_json.hpp"
#include "table.hpp"
#include "topic/topic.hpp"

namespace takt::tools::topic_command {
namespace {

using nlohmann::json;

std::string text_of(const QoS& qos) {
  std::string text = qos.reliability == Reliability::reliable ? "reliable" : "best effort";
  text += qos.durability == Durability::transient_local ? ", transient local" : ", volatile";
  const auto add = [&](const char* name, Nanoseconds duration) {
    if (duration != Nanoseconds::zero()) text += fmt::format(", {} {}", name, to_string(duration));
  };
  add("deadline", qos.deadline_period);
  add("lifespan", qos.lifespan_duration);
  add("lease", qos.lease_duration);
  return text;
}

struct Topic {
  std::set<std::string> types;
  std::size_t publishers = 0, subscriptions = 0;
};

/// By name, hidden ones if they are wanted.
std::map<std::string, Topic> topics_of(const Graph& graph, const Options& options) {
  std::map<std::string, Topic> topics;
  const auto add = [&](const std::vector<GraphEndpoint>& ends, auto count) {
    for (const GraphEndpoint& end : ends) {
      if (is_hidden(end.name) && !options.all) continue;
      Topic& topic = topics[end.name];
      topic.types.insert(end.type);
      ++(topic.*count);
    }
  };
  add(graph.publishers, &Topic::publishers);
  add(graph.subscriptions, &Topic::subscriptions);
  return topics;
}

// As ROS 2 shows an end.
std::string duration_text(Nanoseconds duration) {
  return QoS::is_for_ever(duration) ? "Infinite" : fmt::format("{} nanoseconds", duration.count());
}

void print_end(const char* kind, const GraphEndpoint& end) {
  const std::size_t slash = end.node.rfind('/');
  const bool is_known = slash != std::string::npos;
  const QoS& qos = end.qos;
  rt::print(
      "Node name: {}\nNode namespace: {}\nTopic type: {}\nTopic type hash: {}\nEndpoint type: {}\n"
      "GID: {}\nQoS profile:\n  Reliability: {}\n  History (Depth): {}\n  Durability: {}\n"
      "  Lifespan: {}\n  Deadline: {}\n  Liveliness: {}\n  Liveliness lease duration: {}\n\n",
      is_known ? end.node.substr(slash + 1) : "_NODE_NAME_UNKNOWN_",
      !is_known    ? "_NODE_NAMESPACE_UNKNOWN_"
      : slash == 0 ? "/"
                   : end.node.substr(0, slash),
      end.type, end.type_hash.empty() ? "INVALID" : end.type_hash, kind, end.gid,
      qos.reliability == Reliability::reliable ? "RELIABLE" : "BEST_EFFORT",
      qos.depth == QoS().keep_all().depth ? "KEEP_ALL" : fmt::format("KEEP_LAST ({})", qos.depth),
      qos.durability == Durability::transient_local ? "TRANSIENT_LOCAL" : "VOLATILE",
      duration_text(qos.lifespan_duration), duration_text(qos.deadline_period),
      qos.liveliness_kind == Liveliness::automatic ? "AUTOMATIC" : "MANUAL_BY_TOPIC",
      duration_text(qos.lease_duration));
}

void print_ends(const char* title, const char* kind, const std::vector<GraphEndpoint>& ends) {
  rt::print("{} count: {}\n\n", title, ends.size());
  for (const GraphEndpoint& end : ends) print_end(kind, end);
}

/// When there is an endpoint of a topic for which `is_meant`, or after some time.
template <class IsMeant>
Graph graph_with(const Options& options, IsMeant is_meant) {
  return Observer(options).whole_graph([&](const Graph& seen) {
    return std::any_of(seen.publishers.begin(), seen.publishers.end(), is_meant) ||
           std::any_of(seen.subscriptions.begin(), seen.subscriptions.end(), is_meant);
  });
}

Graph graph_with_topic(const Options& options, const std::string& topic) {
  return graph_with(options, [&](const GraphEndpoint& end) { return end.name == topic; });
}

}  // namespace

void list(const Options& options) {
  const auto is_shown = [&](const GraphEndpoint& end) {
    return options.all || !is_hidden(end.name);
  };
  const auto topics = topics_of(graph_with(options, is_shown), options);
  const bool prints_table = options.json_path != "-" && !options.shows_types;
  Table table({"topic", "type", "publishers", "subscriptions"});
  json rows = json::array();
  for (const auto& [name, row] : topics) {
    const std::string types = fmt::format("{}", fmt::join(row.types, ", "));
    table.add({name, types, std::to_string(row.publishers), std::to_string(row.subscriptions)});
    if (!prints_table && options.json_path != "-") rt::print("{} [{}]\n", name, types);
    rows.push_back({{"topic", name},
                    {"types", row.types},
                    {"publishers", row.publishers},
                    {"subscriptions", row.subscriptions}});
  }
  if (rows.empty()) rt::to_stderr("no topic on DDS domain {}\n", options.domain.number());
  if (prints_table) table.print("topics");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void info(const Options& options) {
  const std::string topic = absolute(options.topic);
  const Graph graph = graph_with_topic(options, topic);
  const auto publishers = ends_of(graph.publishers, topic),
             subscriptions = ends_of(graph.subscriptions, topic);
  if (publishers.empty() && subscriptions.empty()) {
    type_of(graph.publishers, graph.subscriptions, topic, "topic");  // throws
  }
  Table table({"end", "node", "type", "QoS"});
  json rows = json::array();
  const auto add = [&](const char* end, const std::vector<GraphEndpoint>& endpoints) {
    for (const GraphEndpoint& endpoint : endpoints) {
      table.add(
          {end, endpoint.node.empty() ? "?" : endpoint.node, endpoint.type, text_of(endpoint.qos)});
      rows.push_back({{"end", end},
                      {"node", endpoint.node},
                      {"type", endpoint.type},
                      {"type_hash", endpoint.type_hash},
                      {"gid", endpoint.gid},
                      {"qos", text_of(endpoint.qos)}});
    }
  };
  add("publisher", publishers);
  add("subscription", subscriptions);
  if (options.json_path != "-" && options.verbose) {
    rt::print("Type: {}\n\n", (publishers.empty() ? subscriptions : publishers).front().type);
    print_ends("Publisher", "PUBLISHER", publishers);
    print_ends("Subscription", "SUBSCRIPTION", subscriptions);
  } else if (options.json_path != "-") {
    table.print(topic);
  }
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void type(const Options& options) {
  const std::string topic = absolute(options.topic);
  const Graph graph = graph_with_topic(options, topic);
  std::set<std::string> types;
  for (const auto* list : {&graph.publishers, &graph.subscriptions}) {
    for (const GraphEndpoint& end : ends_of(*list, topic)) types.insert(end.type);
  }
  if (types.empty()) type_of(graph.publishers, graph.subscriptions, topic, "topic");  // throws
  for (const std::string& each : types) rt::print("{}\n", each);
}

void find(const Options& options) {
  std::vector<std::string> names;
  const auto is_meant = [&](const GraphEndpoint& end) { return end.type == options.type; };
  for (const auto& [name, topic] : topics_of(graph_with(options, is_meant), options)) {
    if (topic.types.contains(options.type)) names.push_back(name);
  }
  if (options.counts) {
    rt::print("{}\n", names.size());
  } else {
    for (const std::string& name : names) rt::print("{}\n", name);
  }
}

}  // namespace takt::tools::topic_command
