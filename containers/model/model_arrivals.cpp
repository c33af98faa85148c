// SPDX-License-Identifier: Apache-2.0
// The arrivals at each callback.
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/entities/subscription.hpp"

namespace takt {

using analysis::ArrivalCurve;

namespace {

std::vector<analysis::Time> times_of(const std::vector<Nanoseconds>& distances) {
  std::vector<analysis::Time> result;
  for (const Nanoseconds distance : distances) result.push_back(distance.count());
  return result;
}

/// As close as any of these, of which there is one. Distances that are not listed add up from
/// these, and are no longer than those of each curve.
ArrivalCurve closest_of(const std::vector<ArrivalCurve>& curves) {
  const ArrivalCurve& first = curves.front();
  if (std::all_of(curves.begin(), curves.end(), [&](const auto& each) { return each == first; }))
    return first;
  std::vector<analysis::Time> distances;
  for (std::size_t i = 0; i < MeasuredCallback::kMostDistances; ++i) {
    const auto arrivals = static_cast<analysis::Count>(i) + 2;
    analysis::Time least = analysis::kUnbounded;
    for (const ArrivalCurve& each : curves) least = std::min(least, each.least_distance(arrivals));
    distances.push_back(least);
  }
  return distances.back() > 0 ? ArrivalCurve::by_distances(std::move(distances))
                              : ArrivalCurve::unknown();
}

}  // namespace

// The `period` of a callback that is no timer promises the minimum distance of its arrivals. It
// counts only if no callback of the system sends to it, or if it lies on a cycle.
std::optional<ModelParts::StatedArrival> ModelParts::stated_arrival(std::size_t index) const {
  const ModelledTopic& topic = topics_.of(index);
  std::optional<StatedArrival> found;
  if (topic.states_arrival != nullptr) {
    const CallbackDescription& described = topic.states_arrival->described;
    found = StatedArrival{*described.arrival, "'arrival'", described.where};
  }
  if (!topics_.senders(index).empty() && !in_circle_.contains(index)) return found;
  for (const std::size_t each : topic.receivers) {
    const ModelledProcess::Callback& callback = *callbacks_[each];
    const auto period = callback.parameters().period;
    if (!period || callback.entity->kind() == EntityKind::timer) continue;
    if (!found) found = StatedArrival{{.period = *period}, "'period'", callback.described.where};
    const Nanoseconds stated = found->arrival.period;
    const bool is_as_stated = topic.states_arrival == nullptr
                                  ? stated == *period
                                  : stated == Nanoseconds::zero() || stated >= *period;
    if (is_as_stated) continue;
    throw Error(
        fmt::format("'{}' has a 'period' of {}, and what it gets has one of {}",
                    model_.system.callbacks[each].name, to_string(*period), to_string(stated)),
        fmt::format("correct one of them ({})", callback.described.where.empty()
                                                    ? "a callback group has it"
                                                    : callback.described.where),
        found->where);
  }
  return found;
}

bool ModelParts::comes_from_outside(std::size_t index) const {
  const EntityKind kind = callbacks_[index]->entity->kind();
  if (is_closed() || kind == EntityKind::timer || kind == EntityKind::waitable) return false;
  return stated_arrival(index) || topics_.of(index).has_uncaused();
}

// All arrivals that a run has shown, whatever their cause; nullopt: none.
std::optional<ArrivalCurve> ModelBuilder::measured_arrivals(const MeasuredCallback& seen) const {
  if (seen.dropped != 0) return ArrivalCurve::unknown();
  if (!seen.least_distances.empty()) {
    return ArrivalCurve::by_distances(times_of(seen.least_distances));
  }
  if (seen.period != Nanoseconds::zero()) {
    return ArrivalCurve::periodic(seen.period.count(), seen.jitter.count());
  }
  if (seen.executions == 1 && measured_->duration != Nanoseconds::zero()) {
    return ArrivalCurve::by_distances({measured_->duration.count()});
  }
  const bool has_run = seen.executions != 0 || seen.longest_execution != Nanoseconds::zero();
  return has_run ? std::optional(ArrivalCurve::unknown()) : std::nullopt;
}

// The measured arrivals that the callback's senders in the system do not explain: they come from a
// thread of a component, a program outside, or a callback that is not in the model.
std::optional<ArrivalCurve> ModelBuilder::unexplained_arrivals(std::size_t index) const {
  const MeasuredCallback* const seen = measured(index);
  if (seen == nullptr) return {};
  // A trace has no causes from other processes: messages from there appear uncaused.
  const std::uint64_t uncaused = senders_elsewhere(index).empty() ? seen->uncaused : 0;
  const auto known = explained(index);
  if (known && seen->executions - uncaused + seen->dropped > *known) {
    return measured_arrivals(*seen);
  }
  MeasuredCallback rest{.executions = uncaused, .least_distances = seen->uncaused_distances};
  if (uncaused != 0) rest.dropped = seen->dropped;
  return measured_arrivals(rest);
}

// A receiver may have come late, or have lost messages, so each gets the closest that any got.
std::optional<ArrivalCurve> ModelBuilder::seen_arrivals(std::size_t index) const {
  const ModelledTopic& topic = topics_.of(index);
  std::vector<ArrivalCurve> found;
  for (const std::size_t each : topic.receivers) {
    const MeasuredCallback* const seen = measured(each);
    const bool is_incomplete = seen != nullptr && seen->dropped != 0;
    if (seen == nullptr || (is_incomplete && topic.lost_by_all() == 0)) continue;
    const auto arrivals =
        topics_.senders(each).empty() ? measured_arrivals(*seen) : unexplained_arrivals(each);
    if (arrivals) found.push_back(*arrivals);
  }
  if (found.empty()) return {};
  return closest_of(found);
}

// Measured arrivals that are closer than the file or the timer's period permits refute it.
void ModelBuilder::compare_arrivals(std::size_t index, const ArrivalCurve& promised,
                                    const std::vector<Nanoseconds>& seen, const char* what) {
  const analysis::Callback& callback = model_.system.callbacks[index];
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto least = promised.least_distance(static_cast<analysis::Count>(i) + 2);
    if (least <= seen[i].count()) continue;
    return assume(
        {.id = "as_declared",
         .state = Assumption::State::refuted,
         .text = fmt::format("{} arrivals of {{}} came within {} in the measured run, "
                             "but its {} allows no fewer than {}",
                             i + 2, to_string(seen[i]), what, to_string(Nanoseconds(least))),
         .name = "'" + callback.name + "'",
         .source = declared_at(callbacks_[index]->described.where),
         .executor = callback.executor});
  }
}

// More than the senders in the file explain came from outside, in all of the run.
void MeasuredRun::compare_number(std::size_t index, const ArrivalCurve& promised,
                                 const StatedArrival& stated) {
  const MeasuredCallback& seen = *measured(index);
  const auto known = explained(index);
  const Nanoseconds length = std::max(measured_->duration, measured_->total_duration);
  if (!known || length == Nanoseconds::zero() || seen.executions <= *known) return;
  const std::uint64_t others = seen.executions - *known;
  const auto most = promised.most(length.count() + length.count() / 10);
  if (others <= static_cast<std::uint64_t>(most) + 1) return;
  assume_of(index, "as_declared",
            fmt::format("{} messages came to {{}} from outside in the measured run, but its {} "
                        "allows no more than {}",
                        others, stated.key, most),
            declared_at(stated.where), Assumption::State::refuted);
}

ArrivalCurve ModelBuilder::declared_arrivals(std::size_t index, const StatedArrival& stated) {
  const bool has_senders = !topics_.senders(index).empty();
  const ArrivalDescription& arrival = stated.arrival;
  const ModelledProcess::Callback& callback = *callbacks_[index];
  const analysis::Callback& described = model_.system.callbacks[index];
  if (is_periodic(index)) {
    throw Error(
        fmt::format("'{}' is a timer, which is released every {}: it has no other 'arrival'",
                    described.name, to_string(callback.entity->period())),
        "remove it", stated.where);
  }
  const ArrivalCurve curve =
      arrival.distances.empty()
          ? ArrivalCurve::periodic(arrival.period.count(), arrival.jitter.count(),
                                   arrival.least_distance.count())
          : ArrivalCurve::by_distances(times_of(arrival.distances));
  for (const std::size_t each : topics_.of(index).receivers) {
    const MeasuredCallback* const seen = measured(each);
    if (seen == nullptr) continue;
    // A trace has no causes of other processes, so these may be messages of the file.
    if (!senders_elsewhere(each).empty()) {
      compare_number(each, curve, stated);
      continue;
    }
    const bool is_alone = topics_.senders(each).empty();
    compare_arrivals(index, curve, is_alone ? seen->least_distances : seen->uncaused_distances,
                     stated.key);
  }
  assume({.id = "as_declared",
          .state = if_watched(),
          .text = has_senders ? "what comes to {} from outside, counted once a second, is no "
                                "closer than declared"
                              : "what comes to {} from outside is no closer than declared",
          .name = "'" + described.name + "'",
          .source = declared_at(stated.where),
          .executor = described.executor});
  return curve;
}

// However it is known that messages come from outside: they take their time, and age.
void ModelBuilder::add_way_from_outside(std::size_t index) {
  const auto* const end = dynamic_cast<const SubscriptionBase*>(callbacks_[index]->entity.get());
  if (end == nullptr) return;
  SystemModel::Callback& facts = model_.callbacks[index];
  const Nanoseconds its = end->qos().lifespan_duration;
  if (!QoS::is_for_ever(its)) facts.lifespan = std::min(facts.lifespan.value_or(its), its);
  const auto delay = description_.delays.find(entry_of(*end));
  if (delay != description_.delays.end())
    facts.longest_way = std::max(facts.longest_way, delay->second.longest);
  if (is_closed()) return;
  limit_depth(index);
  if (end->qos().reliability == Reliability::best_effort) {
    facts.best_effort = fmt::format(
        "messages on '{}' come from outside, and `best_effort` may lose them", end->topic());
  }
}

// The arrivals at a callback, without messages from callbacks of the system; nullopt: none.
std::optional<ArrivalCurve> ModelBuilder::arrivals_of(std::size_t index) {
  const ModelledProcess::Callback& callback = *callbacks_[index];
  if (const auto stated = stated_arrival(index)) return declared_arrivals(index, *stated);
  if (in_circle_.contains(index)) return ArrivalCurve::unknown();
  const EntityKind kind = callback.entity->kind();
  const MeasuredCallback* const seen = measured(index);
  if (kind == EntityKind::timer && is_periodic(index)) {
    const CallbackDescription& described = callback.described;
    if (described.parameters.period.value_or(callback.entity->period()) !=
        callback.entity->period()) {
      throw Error(
          fmt::format("'{}' is a timer, which is released every {}: it has no 'period' of {}",
                      model_.system.callbacks[index].name, to_string(callback.entity->period()),
                      to_string(*described.parameters.period)),
          "remove it", described.where);
    }
    const ArrivalCurve curve = ArrivalCurve::periodic(callback.entity->period().count());
    if (seen != nullptr) compare_arrivals(index, curve, seen->least_distances, "period");
    return curve;
  }
  const auto arrivals = seen_arrivals(index);
  if (!topics_.senders(index).empty()) return arrivals;
  const bool is_receiver =
      kind == EntityKind::subscription || kind == EntityKind::service || kind == EntityKind::client;
  const bool may_be_called = !is_receiver || joins_dds();
  if (is_timeout(*callback.entity) && (seen == nullptr || seen->executions == 0)) {
    assume_of(index, "requests_are_answered", "{} never comes: each request is answered in time");
    return {};
  }
  if (arrivals || !may_be_called) return arrivals;
  if (topics_.of(index).in_run.empty()) return ArrivalCurve::unknown();
  if (!is_receiver) {  // the others: no_other_publishers
    assume_unseen(fmt::format("something calls '{}'", model_.system.callbacks[index].name), index);
  }
  return arrivals;
}

void ModelBuilder::set_arrivals(std::size_t index) {
  analysis::Callback& described = model_.system.callbacks[index];
  described.arrivals = arrivals_of(index);
  if (described.arrivals) add_way_from_outside(index);
  std::string& unknown = model_.system.executors[described.executor].unknown;
  const bool may_run = described.arrivals || !topics_.senders(index).empty();
  may_run_.push_back(may_run);
  const CallbackDescription& stated = callbacks_[index]->described;
  if (!may_run && stated.waits && !stated.where.empty()) {
    throw Error(fmt::format("'{}' never runs, so it does not wait", described.name),
                "remove 'waits', or correct its topic", stated.where);
  }
  if (may_run && model_.callbacks[index].execution == Provenance::unknown && unknown.empty()) {
    unknown = fmt::format(
        "the execution time of '{}' is not known; declare it (`execution`), or measure it (`takt "
        "model`)",
        described.name);
  }
  const Entity& entity = *callbacks_[index]->entity;
  if (entity.kind() != EntityKind::timer || !is_periodic(index)) return;
  described.is_timer = true;
  described.longest_gap = entity.period().count();
  model_.callbacks[index].period = entity.period();
  const int releases = callbacks_[index]->parameters().releases.value_or(1);
  if (releases > 1 && !described.depth) described.depth = releases;
}

}  // namespace takt
