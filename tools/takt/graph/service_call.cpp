// SPDX-License-Identifier: Apache-2.0
#include "graph/service_call.hpp"

#include <algorithm>

#include <fmt/ranges.h>

#include "takt/measuring/output.hpp"

#include "graph/observer.hpp"
#include "run/live_line.hpp"

namespace takt::tools {

std::vector<std::string> Caller::find(const std::string& ending) {
  std::this_thread::sleep_until(discovered_);
  comes_true([&] { return !owners(ending).empty(); }, std::chrono::seconds(3));
  std::vector<std::string> found = owners(ending);
  if (found.size() == kMostAsked) rt::to_stderr("note: only {} of them are asked\n", kMostAsked);
  return found;
}

std::map<std::string, std::size_t> owners_in(const Graph& graph, std::string_view ending,
                                             std::string_view type, std::size_t most) {
  std::map<std::string, std::size_t> counts, chosen;
  std::map<std::string, std::vector<std::string>> by_process;
  for (const GraphEndpoint& service : graph.services) {
    if (!service.name.ends_with(ending) || !is_topic_name(service.name)) continue;
    if (!type.empty() && service.type != type) continue;
    std::string name = service.name.substr(1, service.name.size() - 1 - ending.size());
    ++counts[name];
    by_process[process_of(service)].push_back(std::move(name));
  }
  for (std::size_t round = 0, left = counts.size(); chosen.size() < std::min(most, left); ++round) {
    for (const auto& [process, names] : by_process) {
      if (round >= names.size() || chosen.size() == most) continue;
      chosen.emplace(names[round], counts[names[round]]);
    }
  }
  return chosen;
}

std::map<std::string, std::size_t> Caller::servers() {
  std::this_thread::sleep_until(discovered_);
  std::map<std::string, std::size_t> counts;
  for (const GraphEndpoint& service : participant_->graph().services) ++counts[service.name];
  return counts;
}

void Caller::check_is_one(const std::string& service, const std::string& whose) {
  check_is_one(servers()[service], whose);
}

void Caller::check_is_one(std::size_t servers, const std::string& whose) {
  if (servers < 2) return;
  throw Error(fmt::format("which {}? {} processes have one of this name", whose, servers),
              "give each its own name, or end the others");
}

Graph Caller::graph() {
  std::this_thread::sleep_until(discovered_);
  Graph graph = participant_->graph();
  const auto is_named = [](const GraphEndpoint& end) { return !end.node.empty(); };
  // Programs without ROS have no names, however long one waits.
  comes_true(
      [&] {
        graph = participant_->graph();
        return std::all_of(graph.publishers.begin(), graph.publishers.end(), is_named) &&
               std::all_of(graph.subscriptions.begin(), graph.subscriptions.end(), is_named);
      },
      std::chrono::milliseconds(500));
  return graph;
}

bool Caller::comes_true(const std::function<bool()>& condition, Nanoseconds limit) {
  const LiveLine line(kDiscovering);
  const TimePoint end = later(Clock::steady().now(), limit);
  while (!condition()) {
    if (Clock::steady().now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::vector<std::string> Caller::owners(const std::string& ending) const {
  std::vector<std::string> names;
  for (const auto& [name, count] : owners_in(participant_->graph(), ending, "", kMostAsked)) {
    names.push_back(name);
  }
  return names;
}

void Caller::no_response(const std::string& whose, Nanoseconds limit) {
  throw Error(fmt::format("no response from {} within {}", whose, to_string(limit)),
              "check that it is not busy or stopped");
}

void Caller::name_silent(const char* what, const std::vector<std::string>& silent,
                         Nanoseconds limit) {
  if (silent.empty()) return;
  std::vector<std::string> names;
  for (const std::string& name : silent) names.push_back(fmt::format("{} '{}'", what, name));
  no_response(fmt::format("{}", fmt::join(names, ", ")), limit);
}

void Caller::nobody(const std::string& service, const std::string& whose) const {
  // "/robot" in "/robot/_container/load_node" and in "/robot/get_state"
  const std::size_t end = std::min(service.find("/_"), service.rfind('/'));
  std::vector<std::string> others = owners(service.substr(end));
  for (std::string& other : others) other = fmt::format("/{}", other);
  throw Error(fmt::format("{} was not found within 3 s", whose),
              others.empty() ? "check that it runs on the same DDS domain (--domain, ROS_DOMAIN_ID)"
                             : suggest(service.substr(0, end), others));
}

}  // namespace takt::tools
