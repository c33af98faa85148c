// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/one_sided_topics.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/transport/local_topics.hpp"

namespace takt {
namespace {

// Limit: topics that are named as having one side only. At it: the others are counted. Seen: the
// same line.
constexpr std::size_t kMostNamed = 10;

}  // namespace

bool is_everywhere(const std::string& topic) {
  return topic == "/rosout" || topic == "/parameter_events" || topic == "/diagnostics" ||
         topic == "/takt/heartbeat" || topic.ends_with("/transition_event") ||
         topic.find("/_") != std::string::npos;
}

std::string OneSidedTopic::reason() const {
  return is_published ? fmt::format("no subscription; published by {}", fmt::join(nodes, ", "))
                      : fmt::format("no publisher; subscribed by {}", fmt::join(nodes, ", "));
}

std::vector<OneSidedTopic> one_sided_topics(Participant* participant) {
  struct Nodes {
    std::set<std::string> publishing, subscribing;
  };
  std::map<std::string, Nodes> topics;
  const LocalTopics here = local_topics();
  for (const Endpoint& end : here.publishers) topics[end.topic].publishing.insert(end.node);
  for (const Endpoint& end : here.subscriptions) topics[end.topic].subscribing.insert(end.node);
  std::erase_if(topics, [](const auto& topic) {  // topics of services have no leading slash
    const Nodes& nodes = topic.second;
    return !topic.first.starts_with('/') ||
           (!nodes.publishing.empty() && !nodes.subscribing.empty());
  });
  // First leave out topics with matches, which are most: the graph of a large system is large, and
  // all its processes read it at the same time.
  if (participant != nullptr && !topics.empty()) {
    for (const EndpointState& end : participant->endpoints()) {
      if (end.matched != 0) topics.erase(end.topic);
    }
  }
  if (participant != nullptr && !topics.empty()) {
    const Graph graph = participant->graph();
    std::set<std::string> published, subscribed;
    for (const GraphEndpoint& end : graph.publishers) published.insert(end.name);
    for (const GraphEndpoint& end : graph.subscriptions) subscribed.insert(end.name);
    std::erase_if(topics, [&](const auto& topic) {
      return (topic.second.publishing.empty() ? published : subscribed).contains(topic.first);
    });
  }
  std::vector<OneSidedTopic> result;
  for (const auto& [name, nodes] : topics) {
    const bool is_published = !nodes.publishing.empty();
    const std::set<std::string>& of = is_published ? nodes.publishing : nodes.subscribing;
    result.push_back({name, is_published, {of.begin(), of.end()}});
  }
  return result;
}

bool is_known_topic(const std::string& name, Participant* participant) {
  const auto is_of = [&](const auto& ends, auto name_of) {
    return std::any_of(ends.begin(), ends.end(),
                       [&](const auto& end) { return end.*name_of == name; });
  };
  const LocalTopics here = local_topics();
  if (is_of(here.publishers, &Endpoint::topic) || is_of(here.subscriptions, &Endpoint::topic)) {
    return true;
  }
  if (participant == nullptr) return false;
  const Graph graph = participant->graph();
  return is_of(graph.publishers, &GraphEndpoint::name) ||
         is_of(graph.subscriptions, &GraphEndpoint::name);
}

std::string hint_at(const std::vector<OneSidedTopic>& topics) {
  std::vector<std::string> texts;
  for (const OneSidedTopic& topic : topics) {
    if (is_everywhere(topic.name)) continue;
    texts.push_back(fmt::format("'{}' ({})", topic.name, topic.reason()));
  }
  if (texts.empty()) return "";
  const std::size_t named = std::min(texts.size(), kMostNamed);
  std::string line = fmt::format("topics without publisher or without subscription: {}",
                                 fmt::join(texts.begin(), texts.begin() + named, ", "));
  if (named < texts.size()) line += fmt::format(", and {} more", texts.size() - named);
  return line;
}

}  // namespace takt
