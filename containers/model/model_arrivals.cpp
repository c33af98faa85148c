// SPDX-License-Identifier: Apache-2.0
// The arrivals at each callback. All subscriptions of a topic get the same, and all servers of a
// service, also if the file or a run gives the arrivals of only one of them.
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

}  // namespace

std::vector<std::size_t> ModelParts::of_same_topic(std::size_t callback) const {
  std::vector<std::size_t> result{callback};
  const Entity& entity = *callbacks_[callback]->entity;
  if (entity.kind() != EntityKind::subscription && entity.kind() != EntityKind::service)
    return result;
  for (std::size_t other = 0; other < callbacks_.size(); ++other) {
    const Entity& its = *callbacks_[other]->entity;
    if (other != callback && its.kind() == entity.kind() && its.topic() == entity.topic())
      result.push_back(other);
  }
  return result;
}

std::optional<analysis::Count> ModelParts::seen_messages(std::size_t from, std::size_t to) const {
  const MeasuredCallback* const seen = measured(from);
  if (seen == nullptr) return {};
  std::optional<analysis::Count> most;
  for (const std::size_t each : of_same_topic(to)) {
    const auto found = seen->causes.find(model_.system.callbacks[each].name);
    if (found == seen->causes.end()) continue;
    most = std::max(most.value_or(1), static_cast<analysis::Count>(found->second));
  }
  return most;
}

const CallbackDescription* ModelParts::states_arrival(std::size_t index) const {
  std::optional<std::size_t> first;
  for (const std::size_t each : of_same_topic(index)) {
    const CallbackDescription& described = callbacks_[each]->described;
    if (!described.arrival) continue;
    if (!first) first = each;
    const CallbackDescription& stated = callbacks_[*first]->described;
    if (*stated.arrival == *described.arrival) continue;
    throw Error(
        fmt::format("'{}' and '{}' get the same, and have another 'arrival' each",
                    model_.system.callbacks[*first].name, model_.system.callbacks[each].name),
        fmt::format("state one for both, or correct that of {}", described.where), stated.where);
  }
  return first ? &callbacks_[*first]->described : nullptr;
}

bool ModelParts::comes_from_outside(std::size_t index) const {
  const EntityKind kind = callbacks_[index]->entity->kind();
  if (is_closed() || kind == EntityKind::timer || kind == EntityKind::waitable) return false;
  if (states_arrival(index) != nullptr) return true;
  const auto same = of_same_topic(index);
  return std::any_of(same.begin(), same.end(), [this](std::size_t each) {
    const MeasuredCallback* const seen = measured(each);
    return seen != nullptr && seen->uncaused != 0;
  });
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
  std::uint64_t explained = 0;
  // The executions that a join explains: as many as its rarest input has.
  std::optional<std::uint64_t> joined;
  bool are_senders_known = measured_->lost_executions == 0, has_senders_outside = false;
  for (std::size_t from = 0; from < callbacks_.size(); ++from) {
    for (const analysis::Output& output : model_.system.callbacks[from].outputs) {
      if (output.to != index) continue;
      const MeasuredCallback* const sender = measured(from);
      are_senders_known = are_senders_known && sender != nullptr;
      has_senders_outside = has_senders_outside || process_of(from) != process_of(index);
      if (sender == nullptr) continue;
      const analysis::Count messages = output.waits ? joined_.at(index) : output.messages;
      const std::uint64_t sent = sender->executions * static_cast<std::uint64_t>(messages);
      if (output.waits) {
        joined = std::min(joined.value_or(sent), sent);
      } else {
        explained += sent;
      }
    }
  }
  explained += joined.value_or(0);
  // A trace has no causes from other processes: messages from there appear uncaused.
  const std::uint64_t uncaused = has_senders_outside ? 0 : seen->uncaused;
  if (are_senders_known && seen->executions - uncaused + seen->dropped > explained) {
    return measured_arrivals(*seen);
  }
  MeasuredCallback rest{.executions = uncaused, .least_distances = seen->uncaused_distances};
  if (uncaused != 0) rest.dropped = seen->dropped;
  return measured_arrivals(rest);
}

// A subscription that was not in the run, or came later, gets what the others of its topic got.
std::optional<ArrivalCurve> ModelBuilder::seen_arrivals(std::size_t index, bool has_senders) const {
  for (const std::size_t each : of_same_topic(index)) {
    const MeasuredCallback* const seen = measured(each);
    if (seen == nullptr) continue;
    const auto arrivals = has_senders ? unexplained_arrivals(each) : measured_arrivals(*seen);
    if (arrivals) return arrivals;
  }
  return {};
}

// The `period` of a callback that is no timer promises the minimum distance of its arrivals. It
// counts only if no callback of the system sends to it, or if it lies on a cycle.
std::optional<ModelBuilder::StatedArrival> ModelBuilder::stated_arrival(std::size_t index,
                                                                        bool has_senders) const {
  if (const CallbackDescription* const stated = states_arrival(index))
    return StatedArrival{*stated->arrival, "'arrival'", stated->where};
  if (has_senders && !in_circle_.contains(index)) return {};
  for (const std::size_t each : of_same_topic(index)) {
    const ModelledProcess::Callback& callback = *callbacks_[each];
    const auto period = callback.parameters().period;
    if (period && callback.entity->kind() != EntityKind::timer)
      return StatedArrival{{.period = *period}, "'period'", callback.described.where};
  }
  return {};
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

ArrivalCurve ModelBuilder::declared_arrivals(std::size_t index, const StatedArrival& stated,
                                             bool has_senders) {
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
  const MeasuredCallback* const seen = measured(index);
  if (seen != nullptr) {
    compare_arrivals(index, curve, has_senders ? seen->uncaused_distances : seen->least_distances,
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
  if (const auto* const end = dynamic_cast<const SubscriptionBase*>(callback.entity.get())) {
    const Nanoseconds its = end->qos().lifespan_duration;
    auto& lifespan = model_.callbacks[index].lifespan;
    if (!QoS::is_for_ever(its)) lifespan = std::min(lifespan.value_or(its), its);
    const auto delay = description_.delays.find(end->topic());
    Nanoseconds& way = model_.callbacks[index].longest_way;
    if (delay != description_.delays.end()) way = std::max(way, delay->second.longest);
  }
  return curve;
}

// The arrivals at a callback, without messages from callbacks of the system; nullopt: none.
std::optional<ArrivalCurve> ModelBuilder::arrivals_of(std::size_t index, bool has_senders) {
  const ModelledProcess::Callback& callback = *callbacks_[index];
  if (const auto stated = stated_arrival(index, has_senders)) {
    return declared_arrivals(index, *stated, has_senders);
  }
  if (in_circle_.contains(index)) return ArrivalCurve::unknown();
  const EntityKind kind = callback.entity->kind();
  const MeasuredCallback* const seen = measured(index);
  if (kind == EntityKind::timer && is_periodic(index)) {
    const ArrivalCurve curve = ArrivalCurve::periodic(callback.entity->period().count());
    if (seen != nullptr) compare_arrivals(index, curve, seen->least_distances, "period");
    return curve;
  }
  const auto arrivals = seen_arrivals(index, has_senders);
  if (has_senders) return arrivals;
  const bool is_receiver =
      kind == EntityKind::subscription || kind == EntityKind::service || kind == EntityKind::client;
  const bool may_be_called = !is_receiver || joins_dds();
  if (is_timeout(*callback.entity) && (seen == nullptr || seen->executions == 0)) {
    assume_of(index, "requests_are_answered", "{} never comes: each request is answered in time");
    return {};
  }
  if (arrivals || !may_be_called) return arrivals;
  if (seen == nullptr) return ArrivalCurve::unknown();
  if (!is_receiver) {  // the others: no_other_publishers
    assume_unseen(fmt::format("something calls '{}'", model_.system.callbacks[index].name), index);
  }
  return arrivals;
}

void ModelBuilder::set_arrivals(std::size_t index) {
  const bool has_senders =
      std::any_of(model_.system.callbacks.begin(), model_.system.callbacks.end(),
                  [&](const analysis::Callback& sender) {
                    return std::any_of(sender.outputs.begin(), sender.outputs.end(),
                                       [&](const auto& output) { return output.to == index; });
                  });
  analysis::Callback& described = model_.system.callbacks[index];
  described.arrivals = arrivals_of(index, has_senders);
  std::string& unknown = model_.system.executors[described.executor].unknown;
  const bool may_run = described.arrivals || has_senders;
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
