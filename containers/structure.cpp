// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/structure.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "takt/containers/container.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt {
namespace {

ContainerStructure::Thread thread_of(const ThreadAttributes& attributes) {
  return {attributes.name,
          std::string(to_string(attributes.policy)),
          attributes.priority,
          {attributes.affinity.begin(), attributes.affinity.end()}};
}

ContainerStructure::Executor executor_of(const ExecutorDescription& executor,
                                         const std::vector<ThreadAttributes>& threads) {
  ContainerStructure::Executor result{executor.name, executor.type, executor.scheduler, {}};
  for (const std::string& name : executor.threads) {
    const auto found = std::find_if(threads.begin(), threads.end(),
                                    [&](const auto& thread) { return thread.name == name; });
    if (found != threads.end()) result.threads.push_back(thread_of(*found));
  }
  return result;
}

std::string topic_of(const Plan& plan, const Node& node, const std::string& callback) {
  const auto found =
      std::find_if(plan.callbacks.begin(), plan.callbacks.end(), [&](const Plan::Callback& each) {
        return each.node.get() == &node && each.entity->name() == callback;
      });
  return found != plan.callbacks.end() ? found->entity->topic() : "";
}

/// The deadline of the whole chain: a part in one process has none of its own.
Nanoseconds deadline_of(const PlannedChain& chain, const SystemDescription& description) {
  for (const ChainDescription& described : description.chains) {
    if (described.options.name == chain.options.name) return described.options.deadline;
  }
  return chain.options.deadline;
}

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

std::vector<ContainerStructure::Rate> rates_of(const Plan& plan,
                                               const std::vector<std::string>& nodes) {
  std::set<std::pair<std::string, std::string>> published;
  for (const Endpoint& end : local_topics().publishers) {
    if (std::find(nodes.begin(), nodes.end(), end.node) != nodes.end()) {
      published.emplace(end.node, end.topic);
    }
  }
  std::vector<ContainerStructure::Rate> rates;
  for (const auto& [node, topic] : published) {
    if (const double hz = rate_hz(plan, node, topic); hz != 0) rates.push_back({node, topic, hz});
  }
  return rates;
}

}  // namespace

ContainerStructure structure_of(const Container& container) {
  ContainerStructure result{.name = container.description().name};
  for (LoadedComponent& component : container.components()) {
    result.nodes.push_back(std::move(component.name));
  }
  const Plan plan = container.plan();
  std::set<std::string> used;
  for (const Plan::Callback& callback : plan.callbacks) {
    const std::string executor = container.executor_of(*callback.node, *callback.entity->group());
    used.insert(executor);
    result.callbacks.push_back(
        {callback.node->fully_qualified_name(), callback.entity->name(), executor});
  }
  const ModelledProcess made = container.modelled();
  for (const ExecutorDescription& executor : made.executors) {
    if (used.contains(executor.name))
      result.executors.push_back(executor_of(executor, made.threads));
  }
  result.rates = rates_of(plan, result.nodes);
  for (const PlannedChain& chain : plan.chains) {
    ContainerStructure::Chain part{
        chain.options.name, deadline_of(chain, container.description()).count(), {}};
    for (const auto& [node, callback] : chain.path) {
      part.steps.push_back(
          {node->fully_qualified_name(), callback, topic_of(plan, *node, callback)});
    }
    result.chains.push_back(std::move(part));
  }
  return result;
}

}  // namespace takt
