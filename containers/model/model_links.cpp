// Which callback sends to which in a model.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/model/model_builder.hpp"

namespace takt {

using analysis::kUnbounded;

void ModelBuilder::link() {
  for (std::size_t to = 0; to < callbacks_.size(); ++to) {
    if (callbacks_[to]->entity->kind() != EntityKind::subscription) continue;
    for (std::size_t from = 0; from < callbacks_.size(); ++from) link(from, to);
  }
}

// Whether a chain of the file goes from one to the other: that is declared.
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

// What is declared or was seen counts. What a run has not shown is left out, but said.
void ModelBuilder::link(std::size_t from, std::size_t to) {
  const std::string topic = callbacks_[to]->entity->report().topic;
  const std::string& name = callbacks_[from]->entity->name();
  const auto publishing = callbacks_[from]->node->publishing_callbacks(topic);
  if (!publishing) return;
  const auto& names = publishing->names;
  const auto& callbacks = model_.system.callbacks;
  const MeasuredCallback* const seen = measured(from);
  const bool is_seen = seen != nullptr && seen->causes.contains(callbacks[to].name);
  const bool is_inside = process_of(from) == process_of(to);
  if (!is_seen) {
    if (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()) return;
    // A trace sees no causes in other processes, and of a join only the last input.
    const bool would_be_seen = seen != nullptr && seen->executions != 0 && is_inside &&
                               !publishing->joins && measured(to) != nullptr;
    if (names.empty() && would_be_seen && !is_step(from, to)) {
      not_seen_.push_back(
          fmt::format("'{}' sends to '{}'", callbacks[from].name, callbacks[to].name));
      return;
    }
  }
  analysis::Output output{.to = to};
  if (is_seen) {
    output.messages = std::max<analysis::Count>(
        1, static_cast<analysis::Count>(seen->causes.at(callbacks[to].name)));
  }
  output.waits = publishing->joins;
  if (output.waits) output.messages = 0;  // one of the inputs gets one, see below
  if (!is_inside) {
    const auto delay = description_.delays.find(topic);
    const bool is_known = delay != description_.delays.end();
    output.delay = is_known ? delay->second.longest.count() : kUnbounded;
    output.least_delay = is_known ? delay->second.least.count() : 0;
  }
  model_.system.callbacks[from].outputs.push_back(output);
}

// Callbacks that lie on circles, or between two: what they send to each other may come at any time.
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

// Of the fastest timer before it; 0 if something else is before it, too.
analysis::Time ModelBuilder::period_before(std::size_t callback) const {
  const analysis::Callback& described = model_.system.callbacks[callback];
  if (described.is_timer) return described.longest_gap;
  if (described.arrivals) return 0;
  analysis::Time least = kUnbounded;
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (output.to != callback) continue;
      if (output.waits) return 0;
      least = std::min(least, period_before(from));
    }
  }
  return least == kUnbounded ? 0 : least;
}

// The slowest input of a join has its messages.
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
  for (const auto& [to, input] : slowest) input.second->messages = 1;
}

}  // namespace takt
