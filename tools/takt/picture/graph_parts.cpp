// SPDX-License-Identifier: Apache-2.0
#include "picture/graph_parts.hpp"

#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace takt::tools {
namespace {

using nlohmann::json;
using End = GraphParts::End;

json process_json(const GraphParts::Process& process) {
  const ContainerStructure& structure = process.structure;
  json executors = json::array(), nodes = json::array();
  for (const ContainerStructure::Executor& executor : structure.executors) {
    json threads = json::array();
    for (const ContainerStructure::Thread& thread : executor.threads) {
      threads.push_back({{"name", thread.name},
                         {"policy", thread.policy},
                         {"priority", thread.priority},
                         {"cpus", thread.cpus}});
    }
    executors.push_back({{"name", executor.name},
                         {"type", executor.type},
                         {"scheduler", executor.scheduler},
                         {"threads", std::move(threads)}});
  }
  std::map<std::string, std::map<std::string, std::vector<std::string>>> callbacks;
  for (const std::string& node : structure.nodes) callbacks[node];
  for (const ContainerStructure::Callback& callback : structure.callbacks) {
    callbacks[callback.node][callback.executor].push_back(callback.name);
  }
  for (const auto& [node, by_executor] : callbacks) {
    nodes.push_back({{"name", node}, {"callbacks", by_executor}});
  }
  return {{"name", structure.name},
          {"container", process.is_container},
          {"executors", std::move(executors)},
          {"nodes", std::move(nodes)}};
}

json end_json(const End& end, const GraphParts& parts) {
  json result{{"process", end.process},
              {"node", end.node},
              {"type", end.type},
              {"depth", end.qos.depth},
              {"reliable", end.qos.reliability == Reliability::reliable},
              {"transient_local", end.qos.durability == Durability::transient_local}};
  for (const GraphParts::Process& process : parts.processes) {
    if (process.structure.name != end.process) continue;
    for (const ContainerStructure::Rate& rate : process.structure.rates) {
      if (rate.node == end.node && rate.topic == end.topic) result["rate_hz"] = rate.hz;
    }
  }
  return result;
}

/// Why the two exchange no messages; empty: they do.
std::string mismatch(const End& from, const End& to) {
  if (from.type != to.type) return fmt::format("type {}, not {}", from.type, to.type);
  const std::string_view refused = from.qos.refuses(to.qos);
  return refused.empty() ? "" : fmt::format("less {} is offered than asked for", refused);
}

json topics_json(const GraphParts& parts) {
  std::map<std::string, json> topics;
  const auto topic = [&](const std::string& name) -> json& {
    return topics
        .try_emplace(name, json{{"name", name},
                                {"publishers", json::array()},
                                {"subscriptions", json::array()},
                                {"mismatches", json::array()}})
        .first->second;
  };
  for (const End& end : parts.publishers) {
    topic(end.topic)["publishers"].push_back(end_json(end, parts));
  }
  for (const End& end : parts.subscriptions) {
    json description = end_json(end, parts);
    description.erase("rate_hz");
    topic(end.topic)["subscriptions"].push_back(std::move(description));
  }
  for (const End& from : parts.publishers) {
    for (const End& to : parts.subscriptions) {
      if (from.topic != to.topic) continue;
      const std::string why = mismatch(from, to);
      if (why.empty()) continue;
      topic(from.topic)["mismatches"].push_back(
          {{"from", from.node}, {"to", to.node}, {"why", why}});
    }
  }
  json result = json::array();
  for (auto& [name, of] : topics) result.push_back(std::move(of));
  return result;
}

json chains_json(const GraphParts& parts) {
  std::map<std::string, json> chains;  // each with its parts in all processes
  for (const GraphParts::Process& process : parts.processes) {
    for (const ContainerStructure::Chain& chain : process.structure.chains) {
      json& known = chains[chain.name];
      known["name"] = chain.name;
      known["deadline_us"] = static_cast<double>(chain.deadline_ns) / 1000;
      for (const ContainerStructure::Step& step : chain.steps) {
        known["steps"].push_back({{"process", process.structure.name},
                                  {"node", step.node},
                                  {"callback", step.callback},
                                  {"topic", step.topic}});
      }
    }
  }
  json result = json::array();
  for (auto& [name, chain] : chains) result.push_back(std::move(chain));
  return result;
}

}  // namespace

json graph_json(const std::string& title, const GraphParts& parts) {
  json processes = json::array();
  for (const GraphParts::Process& process : parts.processes) {
    processes.push_back(process_json(process));
  }
  return {{"title", title},
          {"processes", std::move(processes)},
          {"topics", topics_json(parts)},
          {"chains", chains_json(parts)}};
}

}  // namespace takt::tools
