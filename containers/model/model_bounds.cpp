// The bounds of a model's chains, and the losses on them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/containers/model/join_losses.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/transport/dds/most_received.hpp"

namespace takt {
namespace {

using analysis::Count;
using analysis::kUnbounded;
using analysis::Time;

// Releases of a timer that wait for it to begin are merged, unless more than one may wait. With
// `skip`, a release is dropped if the earlier one has not ended.
Loss loss_of_timer(const std::string& name, const SystemModel::Callback& facts,
                   const analysis::Callback& callback, analysis::Time bound) {
  const analysis::Time period = facts.period.count();
  const analysis::Time waiting = facts.skips ? bound : bound - callback.least_execution;
  const Count kept = facts.skips ? 1 : std::max<Count>(callback.depth.value_or(1), 1);
  if (waiting <= analysis::times(period, kept)) return {};
  const Count releases = (waiting + period - 1) / period - (kept - 1);
  return {facts.skips
              ? fmt::format("'{}' may end so late that of {} releases all but one are skipped",
                            name, releases)
              : fmt::format("'{}' may begin so late that {} releases are served at once", name,
                            releases),
          releases};
}

// The time from sending a message to the end of its callback.
Time since_sent(const SystemModel::Callback& callback, const analysis::CallbackBound& bound) {
  return analysis::plus(bound.bound, callback.longest_way.count());
}

Loss loss_of_overrun(const SystemModel& model, const ModelBounds& bounds, std::size_t index) {
  const auto& limit = model.callbacks[index].given_up_after;
  if (!limit || since_sent(model.callbacks[index], bounds.all.callbacks[index]) <= limit->count())
    return {};
  return {fmt::format("'{}' may take longer than {}, and its `overrun` then ends the instance",
                      model.system.callbacks[index].name, to_string(*limit)),
          0};
}

// Why an overrun at these callbacks or their successors may end the instance, for all of its
// receivers.
std::string why_ended_by(const SystemModel& model, const ModelBounds& bounds,
                         std::vector<std::size_t> left, std::vector<bool> seen) {
  while (!left.empty()) {
    const std::size_t index = left.back();
    left.pop_back();
    if (seen[index]) continue;
    seen[index] = true;
    if (Loss loss = loss_of_overrun(model, bounds, index); !loss.why.empty()) return loss.why;
    for (const analysis::Output& output : model.system.callbacks[index].outputs) {
      left.push_back(output.to);
    }
  }
  return {};
}

// Whether all messages of the callback come from one timer or one topic from outside, on a single
// path: otherwise the overwritten messages may all be of the same source.
bool has_one_way(const SystemModel& model, std::size_t to) {
  for (std::size_t steps = 0; steps < model.system.callbacks.size(); ++steps) {
    std::vector<std::size_t> senders;
    for (std::size_t from = 0; from < model.system.callbacks.size(); ++from) {
      for (const analysis::Output& output : model.system.callbacks[from].outputs) {
        if (output.to == to) senders.push_back(from);
      }
    }
    if (model.system.callbacks[to].arrivals) return senders.empty();
    if (senders.size() != 1) return false;
    to = senders.front();
  }
  return false;
}

// Losses after which the callback may not run at all for the next message, unlike overwriting.
Loss loss_of_messages(const SystemModel& model, const ModelBounds& bounds, std::size_t index) {
  const SystemModel::Callback& facts = model.callbacks[index];
  const analysis::CallbackBound& bound = bounds.all.callbacks[index];
  const analysis::Callback& callback = model.system.callbacks[index];
  const std::string& name = callback.name;
  if (facts.dropped != 0) {
    return {fmt::format("'{}' lost {} in the measured run", name, facts.dropped), 0};
  }
  if (Loss loss = loss_of_overrun(model, bounds, index); !loss.why.empty()) return loss;
  if (facts.lifespan &&
      since_sent(facts, bound) - callback.least_execution > facts.lifespan->count()) {
    return {fmt::format("messages of '{}' may take and wait longer than their lifespan, {}", name,
                        to_string(*facts.lifespan)),
            0};
  }
  const auto depth = static_cast<Count>(facts.depth);
  const Count held = analysis::plus(std::min(bound.backlog, depth), 1);  // and the one being read
  if (analysis::times(held, static_cast<Count>(facts.bytes)) > static_cast<Count>(kMostReceived)) {
    return {
        fmt::format("{} messages of {} bytes may wait for '{}', and those of a topic from other "
                    "processes have a gibibyte",
                    held, facts.bytes, name),
        0};
  }
  return {};
}

Loss loss_at(const SystemModel& model, const ModelBounds& bounds, std::size_t index) {
  const SystemModel::Callback& facts = model.callbacks[index];
  const analysis::Callback& callback = model.system.callbacks[index];
  const analysis::CallbackBound& bound = bounds.all.callbacks[index];
  const std::string& name = callback.name;
  if (Loss loss = loss_of_messages(model, bounds, index); !loss.why.empty()) return loss;
  if (callback.is_timer && facts.period > Nanoseconds::zero()) {
    return loss_of_timer(name, facts, callback, bound.bound);
  }
  if (facts.merges && callback.arrivals) {
    const Count most = callback.arrivals->most(bound.bound - callback.least_execution + 1);
    if (most > 1) {
      return {fmt::format("'{}' may begin so late that {} triggers are served at once", name, most),
              most};
    }
  }
  const auto depth = static_cast<Count>(facts.depth);
  if (depth == 0 || bound.backlog <= depth) return {};
  if (bound.backlog >= kUnbounded) {
    return {fmt::format("it is not known how many messages wait for '{}'", name), 0};
  }
  return {fmt::format("of {} messages that may wait for '{}', {} may be overwritten: its depth is "
                      "{}",
                      bound.backlog, name, bound.backlog - depth, depth),
          has_one_way(model, index) ? bound.backlog : 0};
}

// Why a branch off the path may end the instance; but not after the path's last callback.
std::string why_ended_beside(const SystemModel& model, const ModelBounds& bounds,
                             const std::vector<std::size_t>& path) {
  std::vector<bool> seen(model.system.callbacks.size());
  seen[path.back()] = true;
  return why_ended_by(model, bounds, {path.begin(), path.end() - 1}, std::move(seen));
}

// Why a user's handler may run for an unknown time, on executors that the bound depends on.
std::string why_handled(const SystemModel& model, const ModelBounds& bounds,
                        const std::set<std::size_t>& executors) {
  for (std::size_t i = 0; i < model.callbacks.size(); ++i) {
    const auto& limit = model.callbacks[i].handled_after;
    const analysis::Callback& callback = model.system.callbacks[i];
    if (!limit || !executors.contains(callback.executor)) continue;
    if (since_sent(model.callbacks[i], bounds.all.callbacks[i]) <= limit->count()) continue;
    return fmt::format(
        "'{}' may take longer than {}: then a handler of its code runs "
        "(`on_deadline_miss`, `on_overrun`), and nobody knows for how long",
        callback.name, to_string(*limit));
  }
  return {};
}

// A publisher out of loans sends nothing: all are with receivers and senders.
Loss loss_of_loans(const SystemModel& model, const ModelBounds& bounds, std::size_t from,
                   std::size_t to) {
  for (const auto& lending : model.callbacks[from].lendings) {
    const auto& receivers = lending.receivers;
    if (std::find(receivers.begin(), receivers.end(), to) == receivers.end()) continue;
    Count out = lending.in_use;
    for (const std::size_t receiver : receivers) {
      const auto depth = static_cast<Count>(model.callbacks[receiver].depth);
      const std::size_t executor = model.system.callbacks[receiver].executor;
      out += std::min(depth, bounds.all.callbacks[receiver].backlog) +
             static_cast<Count>(model.system.executors[executor].threads);
    }
    if (out <= lending.loans) continue;
    return {fmt::format("'{}' may find nothing to send: its publisher on '{}' lends {}, and {} may "
                        "be with receivers and senders",
                        model.system.callbacks[from].name, lending.topic,
                        counted(static_cast<std::size_t>(lending.loans), "message"), out),
            0};
  }
  return {};
}

// Why a message may be lost on its way to the callback, or, by `loss`, at the callback.
std::string why_lost(const SystemModel& model, const ModelBounds& bounds, std::size_t index,
                     Loss loss) {
  const std::string& best_effort = model.callbacks[index].best_effort;
  if (!best_effort.empty()) return best_effort;
  std::vector<bool> seen(model.system.callbacks.size());
  if (loss.why.empty()) loss.why = why_ended_by(model, bounds, {index}, std::move(seen));
  for (std::size_t from = 0; loss.why.empty() && from < model.callbacks.size(); ++from) {
    loss = loss_of_loans(model, bounds, from, index);
  }
  return loss.why;
}

void find_losses(const SystemModel& model, const ModelBounds& bounds,
                 const std::vector<std::size_t>& path, ModelBounds::Chain& result) {
  const auto why_lost_at = [&](std::size_t callback) {
    return why_lost(model, bounds, callback, loss_at(model, bounds, callback));
  };
  for (const std::size_t callback : path) {
    Loss loss = loss_at(model, bounds, callback);
    const std::string& best_effort = model.callbacks[callback].best_effort;
    if (!best_effort.empty()) loss = {best_effort, 0};
    result.one_of = analysis::times(result.one_of, loss.one_of);
    if (result.why_lossy.empty()) result.why_lossy = loss.why;
  }
  for (std::size_t i = 1; i < path.size(); ++i) {
    Loss loss = loss_of_loans(model, bounds, path[i - 1], path[i]);
    result.one_of = analysis::times(result.one_of, loss.one_of);
    if (result.why_lossy.empty()) result.why_lossy = std::move(loss.why);
    loss = loss_of_join(model, bounds.all, path[i - 1], path[i], why_lost_at);
    result.one_of = analysis::times(result.one_of, loss.one_of);
    if (result.why_lossy.empty()) result.why_lossy = std::move(loss.why);
  }
  const std::string beside = why_ended_beside(model, bounds, path);
  if (beside.empty()) return;
  result.one_of = 0;  // every instance may end early
  if (result.why_lossy.empty()) result.why_lossy = beside;
}

// Whether a message sent to the callback may be lost. The bound of a join depends on this.
bool may_lose(const SystemModel& model, const ModelBounds& bounds, std::size_t index) {
  return !why_lost(model, bounds, index, loss_of_messages(model, bounds, index)).empty();
}

analysis::Bounds bounds_of(const SystemModel& model, const analysis::System& system,
                           analysis::Time limit) {
  try {
    return analysis::analyze(system, {.methods = {}, .limit = limit, .explains = true});
  } catch (const analysis::TooManyPaths& error) {
    throw Error(error.what(), "let another executor serve some of its nodes",
                model.executors_at.at(error.executor()));
  }
}

bool has_joins(const analysis::System& system) {
  return std::any_of(
      system.callbacks.begin(), system.callbacks.end(), [](const analysis::Callback& callback) {
        return std::any_of(callback.outputs.begin(), callback.outputs.end(),
                           [](const analysis::Output& output) { return output.waits; });
      });
}

}  // namespace

analysis::Time longest_bound(const SystemModel& model) {
  Nanoseconds longest = std::chrono::milliseconds(100);
  for (const auto& chain : model.chains) longest = std::max(longest, chain.deadline);
  for (const auto& callback : model.callbacks) longest = std::max(longest, callback.period);
  return 10 * longest.count();
}

ModelBounds analyze(const SystemModel& model) {
  const analysis::Time limit = longest_bound(model);
  ModelBounds bounds{bounds_of(model, model.system, limit), {}};
  // A fixed point: losses depend on bounds, and the bounds of joins grow with losses.
  analysis::System system = model.system;
  for (bool has_changed = has_joins(system); std::exchange(has_changed, false);) {
    for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
      if (system.callbacks[i].may_lose || !may_lose(model, bounds, i)) continue;
      system.callbacks[i].may_lose = has_changed = true;
    }
    if (has_changed) bounds.all = bounds_of(model, system, limit);
  }
  for (const SystemModel::Chain& chain : model.chains) {
    ModelBounds::Chain& result = bounds.chains.emplace_back();
    result.why_not = chain.why_not;
    if (!chain.why_not.empty()) continue;
    const analysis::ChainBound& found = bounds.all.chains[chain.index];
    result.why_not = found.why_not;
    if (result.why_not.empty()) result.why_not = why_handled(model, bounds, chain.executors);
    if (!result.why_not.empty()) continue;
    if (chain.delay >= kUnbounded) {
      result.why_not =
          "it is not known how long messages to its first callback are on their way: "
          "their topic has no `delay`";
      continue;
    }
    result.bound = Nanoseconds(analysis::plus(found.bound, chain.delay));
    find_losses(model, bounds, model.system.chains[chain.index].callbacks, result);
  }
  return bounds;
}

}  // namespace takt
