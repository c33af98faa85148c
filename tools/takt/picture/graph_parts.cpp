// SPDX-License-Identifier: Apache-2.0
#include "picture/graph_parts.hpp"

#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "takt/measuring/output.hpp"

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

/// How often a node of a process publishes on a topic.
using Rates = std::map<std::tuple<std::string_view, std::string_view, std::string_view>, double>;

Rates rates_of(const GraphParts& parts) {
  Rates rates;
  for (const GraphParts::Process& process : parts.processes) {
    for (const ContainerStructure::Rate& rate : process.structure.rates) {
      rates[{process.structure.name, rate.node, rate.topic}] = rate.hz;
    }
  }
  return rates;
}

json end_json(const End& end) {
  return {{"process", end.process},
          {"node", end.node},
          {"type", end.type},
          {"depth", end.qos.depth},
          {"reliable", end.qos.reliability == Reliability::reliable},
          {"transient_local", end.qos.durability == Durability::transient_local}};
}

/// Why the two exchange no messages; empty: they do.
std::string mismatch(const End& from, const End& to) {
  if (from.type != to.type) return fmt::format("type {}, not {}", from.type, to.type);
  const std::string_view refused = from.qos.refuses(to.qos);
  return refused.empty() ? "" : fmt::format("less {} is offered than asked for", refused);
}

/// Those of a topic. Of endpoints that others may have made there may be any number.
json mismatches_json(const std::vector<const End*>& publishers,
                     const std::vector<const End*>& subscriptions) {
  // Limit: pairs of a topic's publishers and subscriptions that `takt graph` compares. At it: the
  // rest is not compared. Seen: a note.
  constexpr std::size_t kMostPairs = 100'000;
  // Limit: mismatches of a topic in a graph. At it: the rest is left out. Seen: a note.
  constexpr std::size_t kMostMismatches = 100;
  json mismatches = json::array();
  std::size_t pairs = 0;
  for (const End* from : publishers) {
    for (const End* to : subscriptions) {
      if (++pairs > kMostPairs || mismatches.size() == kMostMismatches) {
        rt::to_stderr("note: not all mismatches of topic '{}' are shown\n", from->topic);
        return mismatches;
      }
      const std::string why = mismatch(*from, *to);
      if (why.empty()) continue;
      mismatches.push_back({{"from", from->node}, {"to", to->node}, {"why", why}});
    }
  }
  return mismatches;
}

json topics_json(const GraphParts& parts) {
  struct Ends {
    std::vector<const End*> publishers, subscriptions;
  };
  std::map<std::string, Ends> topics;
  for (const End& end : parts.publishers) topics[end.topic].publishers.push_back(&end);
  for (const End& end : parts.subscriptions) topics[end.topic].subscriptions.push_back(&end);
  const Rates rates = rates_of(parts);
  json result = json::array();
  for (const auto& [name, ends] : topics) {
    json topic{{"name", name}, {"publishers", json::array()}, {"subscriptions", json::array()}};
    for (const End* end : ends.publishers) {
      topic["publishers"].push_back(end_json(*end));
      const auto rate = rates.find({end->process, end->node, name});
      if (rate != rates.end()) topic["publishers"].back()["rate_hz"] = rate->second;
    }
    for (const End* end : ends.subscriptions) topic["subscriptions"].push_back(end_json(*end));
    topic["mismatches"] = mismatches_json(ends.publishers, ends.subscriptions);
    result.push_back(std::move(topic));
  }
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
