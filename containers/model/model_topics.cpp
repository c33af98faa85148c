// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/model_topics.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/planning/plan.hpp"

namespace takt {
namespace {

std::string chain_name_of(const ModelledProcess::Callback& callback) {
  return to_string(Chain::Step{callback.node, callback.entity->name()});
}

void add_stated(const ModelledProcess::Callback& receiver, ModelledTopic& topic) {
  const auto& arrival = receiver.described.arrival;
  if (!arrival) return;
  if (topic.states_arrival == nullptr) topic.states_arrival = &receiver;
  const ModelledProcess::Callback& first = *topic.states_arrival;
  if (*first.described.arrival == *arrival) return;
  throw Error(fmt::format("'{}' and '{}' get the same, and have another 'arrival' each",
                          chain_name_of(first), chain_name_of(receiver)),
              fmt::format("state one for both, or correct that of {}", receiver.described.where),
              first.described.where);
}

}  // namespace

bool ModelledTopic::was_received() const {
  return std::any_of(in_run.begin(), in_run.end(),
                     [](const MeasuredCallback* seen) { return seen->executions != 0; });
}

bool ModelledTopic::has_uncaused() const {
  return std::any_of(in_run.begin(), in_run.end(),
                     [](const MeasuredCallback* seen) { return seen->uncaused != 0; });
}

std::uint64_t ModelledTopic::lost_by_all() const {
  std::uint64_t got_all = 0, most = 0, lost = 0;
  for (const MeasuredCallback* const seen : in_run) {
    if (seen->dropped == 0) got_all = std::max(got_all, seen->executions);
    most = std::max(most, seen->executions + seen->dropped);
    lost = std::max(lost, seen->dropped);
  }
  return got_all >= most ? 0 : lost;
}

ModelTopics::ModelTopics(std::span<const ModelledProcess::Callback* const> callbacks,
                         std::span<const MeasuredCallback* const> measured) {
  std::map<std::pair<EntityKind, std::string>, std::size_t> known;
  std::map<std::string, std::size_t> by_name;
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    const Entity& entity = *callbacks[i]->entity;
    const EntityKind kind = entity.kind();
    const bool is_shared = kind == EntityKind::subscription || kind == EntityKind::service;
    std::size_t topic = all_.size();
    if (is_shared) {
      topic = known.try_emplace({kind, std::string(entity.topic())}, topic).first->second;
    }
    if (topic == all_.size()) all_.emplace_back();
    of_.push_back(topic);
    all_[topic].receivers.push_back(i);
    add_stated(*callbacks[i], all_[topic]);
    by_name.emplace(chain_name_of(*callbacks[i]), topic);
    if (measured[i] != nullptr) all_[topic].in_run.push_back(measured[i]);
  }
  for (std::size_t from = 0; from < callbacks.size(); ++from) {
    if (measured[from] == nullptr) continue;
    for (const auto& [name, count] : measured[from]->causes) {
      const auto found = by_name.find(name);
      if (found == by_name.end()) continue;  // it is not in the file any more
      analysis::Count& most = all_[found->second].at_once[from];
      most = std::max({most, static_cast<analysis::Count>(count), analysis::Count{1}});
    }
  }
}

void ModelTopics::find_senders(const analysis::System& system) {
  senders_.assign(system.callbacks.size(), {});
  for (std::size_t from = 0; from < senders_.size(); ++from) {
    for (const analysis::Output& output : system.callbacks[from].outputs)
      senders_[output.to].push_back(from);
  }
}

std::optional<analysis::Count> ModelTopics::at_once(std::size_t from, std::size_t to) const {
  const auto& senders = of(to).at_once;
  const auto found = senders.find(from);
  return found != senders.end() ? std::optional(found->second) : std::nullopt;
}

}  // namespace takt
