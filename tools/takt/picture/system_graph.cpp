// SPDX-License-Identifier: Apache-2.0
#include "picture/system_graph.hpp"

#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/containers/container.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/transport/local_topics.hpp"

#include "run/constructor_exit.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

json executors_of(const SystemDescription& process, std::set<std::string> used) {
  json result = json::array();
  for (const ExecutorDescription& executor : process.executors) {
    json threads = json::array();
    for (const std::string& name : executor.threads) {
      for (const ThreadDescription& thread : process.threads) {
        if (thread.attributes.name != name) continue;
        threads.push_back({{"name", name},
                           {"policy", std::string(to_string(thread.attributes.policy))},
                           {"priority", thread.attributes.priority},
                           {"cpus", thread.attributes.affinity}});
      }
    }
    used.erase(executor.name);
    result.push_back({{"name", executor.name},
                      {"type", executor.type},
                      {"scheduler", executor.scheduler},
                      {"threads", std::move(threads)}});
  }
  for (const std::string& name : used) {  // the one that is there if the file has none
    result.push_back({{"name", name},
                      {"type", ExecutorDescription().type},
                      {"scheduler", ""},
                      {"threads", json::array()}});
  }
  return result;
}

/// A publisher or subscription.
struct End {
  std::string process, node, topic, type;
  QoS qos;
  double rate_hz = 0;  // of what it publishes; 0: unknown

  json description() const {
    json result{{"process", process},
                {"node", node},
                {"type", type},
                {"depth", qos.depth},
                {"reliable", qos.reliability == Reliability::reliable},
                {"transient_local", qos.durability == Durability::transient_local}};
    if (rate_hz != 0) result["rate_hz"] = rate_hz;
    return result;
  }
};

/// What all processes have.
struct Parts {
  json processes = json::array();
  std::vector<End> publishers, subscriptions;
  std::map<std::string, json> chains;  // the steps in each process, by the chain's name
};

/// Messages a second, where the code says which timer's callbacks publish them.
double rate_hz(const Plan& plan, const std::string& node, const std::string& topic) {
  double rate = 0;
  for (const Plan::Callback& callback : plan.callbacks) {
    const Node& owner = *callback.node;
    if (callback.period == Nanoseconds::zero() || owner.fully_qualified_name() != node) continue;
    const auto publishing = owner.publishing_callbacks(topic);
    if (!publishing || publishing->names.empty()) continue;
    if (owner.publishes(callback.entity->name(), topic)) {
      rate += 1e9 / static_cast<double>(callback.period.count());
    }
  }
  return rate;
}

json process_of(const std::string& name, const Container& container, const Plan& plan) {
  std::map<std::string, std::map<std::string, std::vector<std::string>>> callbacks;
  std::set<std::string> used;
  for (const LoadedComponent& component : container.components()) callbacks[component.name];
  for (const Plan::Callback& callback : plan.callbacks) {
    const Node& node = *callback.node;
    const std::string executor = container.executor_of(node, *callback.entity->group());
    used.insert(executor);
    callbacks[node.fully_qualified_name()][executor].push_back(callback.entity->name());
  }
  json nodes = json::array();
  for (const auto& [node, by_executor] : callbacks) {
    nodes.push_back({{"name", node}, {"callbacks", by_executor}});
  }
  return {{"name", name},
          {"executors", executors_of(container.description(), std::move(used))},
          {"nodes", std::move(nodes)}};
}

void add_process(SystemDescription process, Parts& parts) {
  process.dds.reset();  // nothing runs
  const std::string name = process.name;
  const LocalTopics before = local_topics();  // an analysis has nodes of the same file, too
  const Container container(process, reports_exit());
  const Plan plan = container.plan();
  parts.processes.push_back(process_of(name, container, plan));
  for (const PlannedChain& chain : plan.chains) {
    json& known = parts.chains[chain.options.name];
    for (const Chain::Step& step : chain.path) {
      known["steps"].push_back({{"process", name},
                                {"node", step.first->fully_qualified_name()},
                                {"callback", step.second},
                                {"topic", step.first->find_entity(step.second)->topic()}});
    }
  }
  const auto add = [&](const std::vector<Endpoint>& from, const std::vector<Endpoint>& others,
                       std::vector<End>& to) {
    std::map<std::pair<std::string, std::string>, int> of_others;
    for (const Endpoint& end : others) ++of_others[{end.topic, end.node}];
    for (const Endpoint& end : from) {
      if (!end.topic.starts_with('/') || is_everywhere(end.topic)) continue;
      if (of_others[{end.topic, end.node}]-- > 0) continue;
      to.push_back(
          {name, end.node, end.topic, end.type->name, end.qos, rate_hz(plan, end.node, end.topic)});
    }
  };
  const LocalTopics here = local_topics();
  add(here.publishers, before.publishers, parts.publishers);
  add(here.subscriptions, before.subscriptions, parts.subscriptions);
}

/// Why the two exchange no messages; empty: they do.
std::string mismatch(const End& from, const End& to) {
  if (from.type != to.type) return fmt::format("type {}, not {}", from.type, to.type);
  const std::string_view refused = from.qos.refuses(to.qos);
  return refused.empty() ? "" : fmt::format("less {} is offered than asked for", refused);
}

json topics_of(const Parts& parts) {
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
    topic(end.topic)["publishers"].push_back(end.description());
  }
  for (const End& end : parts.subscriptions) {
    topic(end.topic)["subscriptions"].push_back(end.description());
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

}  // namespace

json system_graph(const std::string& file) {
  const SystemDescription system = read_system(file);
  Parts parts;
  for (const SystemDescription& process : split(system, Composition::file)) {
    add_process(process, parts);
  }
  json chains = json::array();
  for (auto& [name, chain] : parts.chains) {
    chain["name"] = name;
    chain["deadline_us"] = 0.0;
    for (const ChainDescription& described : system.chains) {
      if (described.options.name == name) chain["deadline_us"] = rt::us(described.options.deadline);
    }
    chains.push_back(std::move(chain));
  }
  json topics = topics_of(parts);
  return {{"file", file},
          {"processes", std::move(parts.processes)},
          {"topics", std::move(topics)},
          {"chains", std::move(chains)}};
}

}  // namespace takt::tools
