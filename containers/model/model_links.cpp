// Which callback sends to which in a model.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {

using analysis::Count;
using analysis::kUnbounded;

namespace {

// Of one process, its container has done so.
void check_topics(const SystemDescription& description,
                  std::span<const ModelledProcess> processes) {
  if (processes.size() == 1) return;
  std::vector<std::shared_ptr<Node>> nodes;
  for (const ModelledProcess& process : processes)
    for (const ModelledProcess::Member& member : process.nodes) nodes.push_back(member.node);
  for (const Error& error : wrong_topics(description, nodes)) throw Error(error);
}

}  // namespace

void ModelBuilder::link() {
  check_topics(description_, processes_);
  std::vector<const MeasuredCallback*> seen;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) seen.push_back(measured(i));
  topics_ = ModelTopics(callbacks_, seen);
  for (std::size_t to = 0; to < callbacks_.size(); ++to) {
    const EntityKind kind = callbacks_[to]->entity->kind();
    if (kind == EntityKind::service) link_callers(to);
    if (kind == EntityKind::client) link_answers(to);
    if (kind == EntityKind::subscription) link_publishers(to);
  }
  link_unexplained();
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs)
      model_.callbacks[from].other_receivers += std::max<Count>(1, output.messages);
  }
  topics_.find_senders(model_.system);
}

// Any callback of a node may call through the node's clients. A callback of a response counts only
// if a run has shown the call: otherwise each service would lie on a cycle.
void ModelBuilder::link_callers(std::size_t service) {
  const std::string name = service_of(callbacks_[service]->entity->topic());
  for (const ModelledProcess::Callback* const client : callbacks_) {
    const Entity& entity = *client->entity;
    if (entity.kind() != EntityKind::client || service_of(entity.topic()) != name) continue;
    for (std::size_t from = 0; from < callbacks_.size(); ++from) {
      if (callbacks_[from]->node != client->node) continue;
      const bool is_response = callbacks_[from]->entity->kind() == EntityKind::client;
      if (topics_.at_once(from, service) || !(is_response || is_timeout(*callbacks_[from]->entity)))
        link(from, service, {name});
    }
  }
}

void ModelBuilder::link_answers(std::size_t client) {
  const std::string name = service_of(callbacks_[client]->entity->topic());
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    const Entity& entity = *callbacks_[from]->entity;
    const bool is_service =
        entity.kind() == EntityKind::service && service_of(entity.topic()) == name;
    if (is_service) link(answering(from), client, {name});
    if (!is_service && topics_.at_once(from, client)) link(from, client, {name});
  }
}

// A coroutine answers when it is resumed.
std::size_t ModelBuilder::answering(std::size_t service) const {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (model_.system.callbacks[i].name == model_.system.callbacks[service].name + "/resumed") {
      return i;
    }
  }
  return service;
}

// Whether a chain of the file declares this link.
bool ModelBuilder::is_step(std::size_t from, std::size_t to) const {
  const auto is_at = [this](const Chain::Step& step, std::size_t callback) {
    return step.first == callbacks_[callback]->node &&
           step.second == callbacks_[callback]->entity->name();
  };
  return !description_.finds_chains &&
         std::any_of(chains_.begin(), chains_.end(), [&](const PlannedChain& chain) {
           for (std::size_t i = 1; i < chain.path.size(); ++i) {
             if (is_at(chain.path[i - 1], from) && is_at(chain.path[i], to)) return true;
           }
           return false;
         });
}

void ModelBuilder::link_publishers(std::size_t to) {
  const std::string topic = callbacks_[to]->entity->topic();
  const Node* node = nullptr;
  // Of this node, whose callbacks are adjacent in the list.
  std::optional<PublishingCallbacks> publishing;
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    if (std::exchange(node, callbacks_[from]->node.get()) != callbacks_[from]->node.get()) {
      publishing = node->publishing_callbacks(topic);
    }
    if (!publishing) continue;
    const auto& names = publishing->names;
    const bool is_declared =
        std::find(names.begin(), names.end(), callbacks_[from]->entity->name()) != names.end();
    const bool may_send = names.empty() || is_declared || topics_.at_once(from, to).has_value();
    if (may_send && is_offered(*publishing, from, to)) {
      link(from, to, {topic, is_declared, publishing->joins});
    }
  }
}

// What a run has shown counts, also if the constructed node has no publisher or client of it:
// another node has it, or the node makes it later. Nobody knows what that one offers.
void ModelBuilder::link_unexplained() {
  for (const ModelledTopic& topic : topics_.all()) {
    const Entity& entity = *callbacks_[topic.receivers.front()]->entity;
    const bool is_service = entity.kind() == EntityKind::service;
    if (!is_service && entity.kind() != EntityKind::subscription) continue;
    for (const auto& [from, messages] : topic.at_once) {
      const auto& outputs = model_.system.callbacks[from].outputs;
      if (std::any_of(outputs.begin(), outputs.end(), [&](const analysis::Output& output) {
            return &topics_.of(output.to) == &topic;
          })) {
        continue;
      }
      for (const std::size_t to : topic.receivers) {
        link(from, to, {is_service ? service_of(entity.topic()) : std::string(entity.topic())});
        if (dynamic_cast<const LifecycleNode*>(callbacks_[from]->node.get()) != nullptr) continue;
        assume_of(
            to, "as_measured",
            fmt::format("in the measured run '{}' sent to {{}}, and its node has no {} that "
                        "does so when it is constructed",
                        model_.system.callbacks[from].name, is_service ? "client" : "publisher"),
            measured_source(), Assumption::State::refuted);
      }
    }
  }
}

// Whether a publisher of the node matches the subscription. If another one does not match, nobody
// knows which of them a callback uses.
bool ModelBuilder::is_offered(const PublishingCallbacks& publishing, std::size_t from,
                              std::size_t to) {
  const auto* const end = dynamic_cast<const SubscriptionBase*>(callbacks_[to]->entity.get());
  auto& lifespan = model_.callbacks[to].lifespan;
  bool result = false;
  for (const PublishingCallbacks::Publisher& publisher : publishing.publishers) {
    const std::string_view policy = publisher.qos.refuses(end->qos());
    if (!policy.empty()) {
      nothing_passes_.try_emplace(
          {from, to}, fmt::format("a publisher of '{}' on '{}' offers less than '{}' asks for: {}",
                                  callbacks_[from]->node->fully_qualified_name(), end->topic(),
                                  model_.system.callbacks[to].name, policy));
      continue;
    }
    result = true;
    const Nanoseconds its = publisher.qos.lifespan_duration;
    if (QoS::is_for_ever(its)) continue;
    lifespan = std::min(lifespan.value_or(its), its);
  }
  return result;
}

// For each node: the loans of its publishers, and the messages that are sent at the end of a
// period.
void ModelBuilder::add_publishers() {
  std::map<const Node*, std::vector<std::size_t>> callbacks;
  std::map<std::pair<const ModelledProcess*, std::string>, std::vector<std::size_t>> receivers;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    callbacks[callbacks_[i]->node.get()].push_back(i);
    if (callbacks_[i]->entity->kind() != EntityKind::subscription) continue;
    receivers[{process_of(i), callbacks_[i]->entity->topic()}].push_back(i);
  }
  std::vector<analysis::Count> outputs(parts_.size());
  for (const auto& [node, its] : callbacks) {
    for (const std::string& topic : node->topics()) {
      add_publishers(*node, topic, its, receivers[{process_of(its.front()), topic}], outputs);
    }
  }
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const TriggerOptions& trigger = parts_[i].description->trigger;
    const auto most = static_cast<analysis::Count>(trigger.most_outputs);
    std::string& unknown = model_.system.executors[i].unknown;
    if (trigger.let_period == Nanoseconds::zero() || outputs[i] <= most || !unknown.empty())
      continue;
    unknown = fmt::format(
        "its callbacks may send {} messages in a period, of which {} wait for its end: further "
        "ones are dropped",
        outputs[i], most);
  }
}

void ModelBuilder::add_publishers(const Node& node, const std::string& topic,
                                  const std::vector<std::size_t>& callbacks,
                                  const std::vector<std::size_t>& receivers,
                                  std::vector<analysis::Count>& outputs) {
  const auto publishing = node.publishing_callbacks(topic);
  if (!publishing) return;
  std::size_t loans = 0;  // of the publisher with the fewest
  for (const PublishingCallbacks::Publisher& publisher : publishing->publishers) {
    if (publisher.loans != 0 && (loans == 0 || publisher.loans < loans)) loans = publisher.loans;
  }
  const auto is_receiver = [&](const analysis::Output& output) {
    return std::find(receivers.begin(), receivers.end(), output.to) != receivers.end();
  };
  std::vector<std::size_t> senders;
  std::set<std::size_t> executors;
  SystemModel::Callback::Lending lending{
      .topic = topic, .loans = static_cast<analysis::Count>(loans), .receivers = receivers};
  for (const std::size_t from : callbacks) {
    analysis::Count messages = node.publishes(callbacks_[from]->entity->name(), topic) ? 1 : 0;
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (is_receiver(output)) messages = std::max({messages, output.messages, Count{1}});
    }
    if (messages == 0) continue;
    senders.push_back(from);
    const std::size_t part = model_.system.callbacks[from].executor;
    outputs[part] += messages;
    const bool waits = parts_[part].description->trigger.let_period != Nanoseconds::zero();
    if (waits) lending.in_use += messages;
    if (executors.insert(part).second) {
      lending.in_use += static_cast<analysis::Count>(model_.system.executors[part].threads);
    }
  }
  if (loans == 0) return;
  for (const std::size_t from : senders) model_.callbacks[from].lendings.push_back(lending);
}

// Adds a link that is declared or was measured. A link that a run could have shown but did not is
// left out, with an assumption.
void ModelBuilder::link(std::size_t from, std::size_t to, const Way& way) {
  const auto& callbacks = model_.system.callbacks;
  const MeasuredCallback* const seen = measured(from);
  const auto messages = topics_.at_once(from, to);
  const bool is_inside = process_of(from) == process_of(to);
  // A trace has no causes from other processes, and only the last input of a join.
  const bool would_be_seen = seen != nullptr && seen->executions != 0 && is_inside && !way.joins &&
                             measured(to) != nullptr;
  if (!messages && !way.is_declared && would_be_seen && !is_step(from, to)) {
    assume_unseen(fmt::format("'{}' sends to '{}'", callbacks[from].name, callbacks[to].name), to);
    return;
  }
  if (!is_inside && description_.dds && description_.dds->discovery == DiscoveryRange::off) {
    throw Error(fmt::format("'{}' sends to '{}' on '{}', and their processes do not find each "
                            "other: `discovery: off`",
                            callbacks[from].name, callbacks[to].name, way.topic),
                "write `discovery: localhost`, or make them components of one container",
                line_of("dds", "discovery"));
  }
  analysis::Output output{.to = to};
  if (messages) output.messages = *messages;
  if (const std::uint64_t lost = topics_.of(to).lost_by_all();
      lost != 0 && is_inside && !said_to_send(from)) {
    assume_unseen(
        fmt::format("'{}' sends more than {} at once to '{}', on whose topic {} lost",
                    callbacks[from].name,
                    counted(static_cast<std::size_t>(output.messages), "message"),
                    callbacks[to].name, lost == 1 ? "1 was" : fmt::format("{} were", lost)),
        to);
  }
  output.waits = way.joins;
  if (output.waits) {  // choose_who_paces_joins() gives them to one input
    Count& most = joined_[to];
    most = std::max(most, std::exchange(output.messages, 0));
  }
  if (!is_inside) {
    const auto delay = description_.delays.find(way.topic);
    const bool is_known = delay != description_.delays.end();
    output.delay = is_known ? delay->second.longest.count() : kUnbounded;
    output.least_delay = is_known ? delay->second.least.count() : 0;
    if (is_known) {
      Nanoseconds& longest = model_.callbacks[to].longest_way;
      longest = std::max(longest, delay->second.longest);
      assume({.id = "as_declared",
              .state = Assumption::State::unchecked,
              .text = "no message on {} takes longer between processes than its `delay` says, or "
                      "less",
              .name = way.topic,
              .source = declared_at(line_of("a topic", "delay")),
              .executor = callbacks[to].executor});
    }
    const auto* const end = dynamic_cast<const SubscriptionBase*>(callbacks_[to]->entity.get());
    limit_depth(to);
    if (end != nullptr && end->qos().reliability == Reliability::best_effort) {
      model_.callbacks[to].best_effort = fmt::format(
          "messages on '{}' go to another process, and `best_effort` may lose them", way.topic);
    }
  }
  model_.system.callbacks[from].outputs.push_back(output);
}

// With shared memory, messages of other processes pass through another queue first.
void ModelBuilder::limit_depth(std::size_t to) {
  if (description_.dds && description_.dds->shared_memory == SharedMemory::off) return;
  std::size_t& depth = model_.callbacks[to].depth;
  depth = std::min(depth, kMostQueued);
  auto& most = model_.system.callbacks[to].depth;
  if (most) most = std::min(*most, static_cast<Count>(kMostQueued));
}

// Removes the links among callbacks on cycles, or between two cycles: their arrivals are unknown.
void ModelBuilder::cut_circles() {
  auto& callbacks = model_.system.callbacks;
  std::vector<bool> is_left(callbacks.size(), true);
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    std::vector<bool> receives(callbacks.size()), sends(callbacks.size());
    for (std::size_t from = 0; from < callbacks.size(); ++from) {
      if (!is_left[from]) continue;
      for (const analysis::Output& output : callbacks[from].outputs) {
        if (is_left[output.to]) receives[output.to] = sends[from] = true;
      }
    }
    for (std::size_t i = 0; i < callbacks.size(); ++i) {
      if (!is_left[i] || (receives[i] && sends[i])) continue;
      is_left[i] = false;
      has_changed = true;
    }
  }
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    if (!is_left[i]) continue;
    in_circle_.insert(i);
    std::erase_if(callbacks[i].outputs,
                  [&](const analysis::Output& output) { return is_left[output.to]; });
  }
}

// The period of the fastest timer among the sources of its messages; 0: there are other sources.
analysis::Time ModelBuilder::period_before(std::size_t callback) const {
  const analysis::Callback& described = model_.system.callbacks[callback];
  if (described.is_timer) return described.longest_gap;
  if (described.arrivals) return 0;
  analysis::Time least = kUnbounded;
  for (const std::size_t from : topics_.senders(callback)) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (output.to != callback) continue;
      if (output.waits) return 0;
      least = std::min(least, period_before(from));
    }
  }
  return least == kUnbounded ? 0 : least;
}

// The input with the longest period triggers the join, and so has its messages.
void ModelBuilder::choose_who_paces_joins() {
  std::map<std::size_t, std::pair<analysis::Time, analysis::Output*>> slowest;  // by receiver
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    for (analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (!output.waits) continue;
      const std::pair candidate(period_before(from), &output);
      const auto [known, is_new] = slowest.try_emplace(output.to, candidate);
      if (!is_new && candidate.first > known->second.first) known->second = candidate;
    }
  }
  for (const auto& [to, input] : slowest) input.second->messages = joined_.at(to);
}

}  // namespace takt
