// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/containers/one_sided_topics.hpp"

#include "graph/observer.hpp"
#include "graph/service_call.hpp"
#include "picture/graph_parts.hpp"
#include "picture/system_graph.hpp"

namespace takt::tools {
namespace {

using Process = GraphParts::Process;
using Endpoints = std::vector<GraphEndpoint>;

constexpr const char* kStructure = "/_container/get_structure";

/// What is found on the domain, by process.
class Processes {
 public:
  Processes(Graph graph, std::vector<ContainerStructure> containers) : graph_(std::move(graph)) {
    std::map<std::string_view, const GraphEndpoint*> services;
    for (const GraphEndpoint& service : graph_.services) services.emplace(service.name, &service);
    for (ContainerStructure& structure : containers) {
      const auto end = services.find(service_of(structure.name, kStructure));
      if (end == services.end()) continue;  // it has gone since it answered
      const std::string gid = process_of(*end->second);
      for (const std::string& node : structure.nodes) nodes_.emplace(gid, node);
      processes_[gid] = {std::move(structure)};
    }
    for (const Endpoints* ends : {&graph_.publishers, &graph_.subscriptions}) {
      for (const GraphEndpoint& end : *ends) {
        std::set<std::string>& users = users_[end.name];
        if (is_drawn(end) && users.size() < 2) users.insert(end.node);
      }
    }
  }

  GraphParts all() {
    for (const Endpoints* ends : {&graph_.services, &graph_.clients}) {
      for (const GraphEndpoint& end : *ends) {
        if (!is_container(end) && !is_hidden(node_of(end))) process(end);
      }
    }
    return parts([](const GraphEndpoint&) { return true; });
  }

  /// These, and what shares topics with them.
  GraphParts only(const std::vector<std::string>& containers) {
    std::set<std::string> topics, drawn;
    const auto is_meant = [&](const std::string& process) {
      const auto found = processes_.find(process);
      return found != processes_.end() &&
             std::find(containers.begin(), containers.end(), found->second.structure.name) !=
                 containers.end();
    };
    for (const Endpoints* ends : {&graph_.publishers, &graph_.subscriptions}) {
      for (const GraphEndpoint& end : *ends) {
        if (is_drawn(end) && is_meant(process_of(end))) topics.insert(end.name);
      }
    }
    for (const Endpoints* ends : {&graph_.publishers, &graph_.subscriptions}) {
      for (const GraphEndpoint& end : *ends) {
        if (topics.contains(end.name)) drawn.insert(process_of(end));
      }
    }
    std::erase_if(processes_, [&](const auto& process) {
      return !drawn.contains(process.first) && !is_meant(process.first);
    });
    return parts([&](const GraphEndpoint& end) { return topics.contains(end.name); });
  }

 private:
  template <class IsMeant>
  GraphParts parts(const IsMeant& is_meant) {
    GraphParts parts;
    const auto add = [&](const Endpoints& ends, std::vector<GraphParts::End>& to) {
      for (const GraphEndpoint& end : ends) {
        if (!is_drawn(end) || is_spare(end) || !is_meant(end)) continue;
        to.push_back({process(end).name, node_of(end), end.name, end.type, end.qos});
      }
    };
    add(graph_.publishers, parts.publishers);
    add(graph_.subscriptions, parts.subscriptions);
    for (auto& [gid, process] : processes_) parts.processes.push_back(std::move(process));
    std::stable_sort(
        parts.processes.begin(), parts.processes.end(), [](const auto& a, const auto& b) {
          return a.is_container > b.is_container ||
                 (a.is_container == b.is_container && a.structure.name < b.structure.name);
        });
    return parts;
  }

  static std::string node_of(const GraphEndpoint& end) { return end.node.empty() ? "?" : end.node; }

  bool is_container(const GraphEndpoint& end) const {
    const auto found = processes_.find(process_of(end));
    return found != processes_.end() && found->second.is_container;
  }

  // What every node has is no part of a system, nor who looks at it.
  static bool is_drawn(const GraphEndpoint& end) {
    return end.name.starts_with('/') && !is_everywhere(end.name) && !is_hidden(end.node);
  }

  // What a container's own node offers need not be wanted by any other.
  bool is_spare(const GraphEndpoint& end) const {
    const auto found = processes_.find(process_of(end));
    if (found == processes_.end() || !found->second.is_container) return false;
    if (nodes_.contains({found->first, end.node})) return false;
    const auto users = users_.find(end.name);
    return users == users_.end() || users->second.size() < 2;  // itself
  }

  /// Its process, which knows its node from now on.
  const ContainerStructure& process(const GraphEndpoint& end) {
    const std::string gid = process_of(end);
    Process& process =
        processes_.try_emplace(gid, Process{.structure = {.name = gid}, .is_container = false})
            .first->second;
    if (nodes_.emplace(gid, node_of(end)).second) process.structure.nodes.push_back(node_of(end));
    return process.structure;
  }

  const Graph graph_;
  std::map<std::string, Process> processes_;             // by what process_of() says
  std::set<std::pair<std::string, std::string>> nodes_;  // of each process
  std::map<std::string, std::set<std::string>> users_;   // of each topic: the nodes
};

}  // namespace

RunningGraph running_graph(const std::vector<std::string>& containers, int domain) {
  Caller caller(domain);
  std::vector<std::string> named;
  const auto whose = [](const std::string& name) { return fmt::format("container '{}'", name); };
  for (const std::string& name : containers) {
    const std::string service = service_of(name, kStructure);
    if (!caller.finds<GetStructure>(service, std::chrono::seconds(3))) {
      caller.nobody(service, whose(name));
    }
    named.push_back(name.starts_with('/') ? name.substr(1) : name);
  }
  const std::vector<std::string> all = caller.find(kStructure);
  auto servers = caller.servers();
  for (const std::string& name : named.empty() ? all : named) {
    Caller::check_is_one(servers[service_of(name, kStructure)], whose(name));
  }
  auto answers = caller.ask_all<GetStructure>(all, kStructure, {}, kListLimit);
  std::vector<ContainerStructure> structures;
  for (auto& [name, answer] : answers.in_time) {
    structures.push_back(std::move(answer.structure));
    structures.back().name = name;
  }
  Processes processes(caller.graph(), std::move(structures));
  const GraphParts parts = named.empty() ? processes.all() : processes.only(named);
  if (parts.processes.empty() && answers.silent.empty()) {
    throw Error(fmt::format("nothing was discovered on DDS domain {}", domain),
                "start a container there (--domain, ROS_DOMAIN_ID), or name a file");
  }
  const std::string title = named.empty() ? fmt::format("DDS domain {}", domain)
                                          : fmt::format("{}", fmt::join(named, ", "));
  std::vector<std::string>& silent = answers.silent;
  std::erase_if(silent, [&](const std::string& name) {
    return !named.empty() && std::find(named.begin(), named.end(), name) == named.end();
  });
  return {graph_json(title, parts), std::move(silent)};
}

}  // namespace takt::tools
