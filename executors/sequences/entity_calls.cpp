// Nodes, timers, subscriptions, guard conditions, parameters and lifecycles.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/same_owner.hpp"
#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {

// ---- Nodes ----

NodeOptions World::node_options() {
  NodeOptions options;
  options.clock = &clock_;
  return options;
}

void World::make_place() {
  if (places_.size() == kMostNodes) return;
  Place place;
  place.node = api_.make_node("node_" + std::to_string(++named_), node_options());
  add_place(std::move(place));
}

void World::make_lifecycle_place() {
  if (places_.size() == kMostNodes) return;
  Place place;
  place.lifecycle =
      std::make_shared<Managed>("node_" + std::to_string(++named_), node_options(), *this);
  place.node = place.lifecycle;
  add_place(std::move(place));
}

void World::add_place(Place place) {
  made_.push_back(place.node->weak_from_this());
  const auto add = [&](const std::shared_ptr<CallbackGroup>& group) {
    made_.push_back(group);
    place.groups.push_back(std::make_shared<Group>(Group{group}));
  };
  add(place.node->default_callback_group());
  add(api_.make_group(place.node, "exclusive", CallbackGroupType::MutuallyExclusive));
  add(api_.make_group(place.node, "reentrant", CallbackGroupType::Reentrant));
  api_.declare_parameter(place.node);
  const auto refuse_odd = [this, weak = std::weak_ptr(place.node)](std::int64_t value) {
    try {
      if (const auto node = weak.lock()) {
        api_.set_parameter(node, value);
        demand(false, "an on-set callback set parameters");
      }
    } catch (const Error&) {
    }
    return value % 2 == 0;
  };
  place.refuses_odd = api_.add_on_set(place.node, refuse_odd);
  if (next() % 4 != 0) attempt([&] { executor_->add_node(place.node); });
  places_.push_back(std::move(place));
}

// The node's entities live on with their handles.
void World::drop_node() {
  if (places_.empty()) return;
  const auto place = places_.begin() + next() % places_.size();
  const Place dropped = std::move(*place);  // destroyed when the list is in order
  places_.erase(place);
  for (const PartPtr& part : parts_) {
    if (is_same_owner(part->lifecycle, dropped.lifecycle)) part->was_active = is_active(*part);
  }
}

void World::add(Executor& executor) {
  const Place* const chosen = any(places_);
  if (chosen == nullptr) return;
  const Place place = *chosen;  // the list may change meanwhile
  const std::size_t group = next() % 4;
  std::vector<std::shared_ptr<Group>> added;
  for (std::size_t i = 0; i < place.groups.size(); ++i) {
    const bool is_meant = group == 3 || group == i;
    if (is_meant && place.groups[i]->group->belongs_to(nullptr)) added.push_back(place.groups[i]);
  }
  attempt([&] {
    if (group == 3) {
      executor.add_node(place.node);
    } else {
      executor.add_callback_group(place.groups[group]->group, place.node);
    }
    for (const auto& each : added) {
      each->is_in_other = &executor == other_.get();
      each->is_moved = each->inside != 0;
    }
  });
}

void World::remove(Executor& executor) {
  const Place* const chosen = any(places_);
  if (chosen == nullptr) return;
  const Place place = *chosen;
  const std::size_t group = next() % 4;
  attempt([&] {
    if (group == 3) {
      executor.remove_node(place.node);
    } else {
      executor.remove_callback_group(place.groups[group]->group, place.node);
    }
  });
}

// ---- Entities ----

void World::make_timer() {
  const Nanoseconds period = kPeriods[next() % kPeriods.size()];
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->is_for_ever = is_for_ever(period);
    part->is_managed = place.lifecycle != nullptr;
    const auto run = [this, part] { ran(part); };
    const auto& group = part->group->group;
    part->timer = place.lifecycle != nullptr
                      ? place.lifecycle->create_timer(name, period, run, group)
                      : api_.make_timer(place.node, name, period, run, group);
    part->is_endless = part->timer->period() == 1ns;
    begin_phase(*part);
  });
}

void World::make_subscription() {
  const int topic = next() % 2;
  const std::size_t depth = 1 + next() % 4;
  make_part([&](Place& place, const PartPtr& part, const std::string&) {
    part->topic = topic;
    part->is_managed = place.lifecycle != nullptr;
    const auto run = [this, part] { ran(part); };
    const auto& group = part->group->group;
    if (place.lifecycle != nullptr) {
      part->subscription = place.lifecycle->create_subscription<Number>(
          kTopics[topic], depth, [run](const Number&) { run(); }, group);
    } else {
      part->subscription = api_.make_subscription(place.node, kTopics[topic], depth, run, group);
    }
  });
}

void World::make_guard() {
  make_part([&](Place& place, const PartPtr& part, const std::string& name) {
    part->guard = place.node->create_guard_condition(
        name, [this, part] { ran(part); }, part->group->group);
  });
}

void World::publish(std::size_t topic) {
  for (const auto& part : parts_) {
    if (part->subscription != nullptr && part->topic == static_cast<int>(topic)) ++part->published;
  }
  publish_[topic]();
}

void World::trigger() {
  if (auto* part = any(parts_); part != nullptr && (*part)->guard) (*part)->guard->trigger();
}

// From its next release on, a timer that nobody touches is released in period.
void World::begin_phase(Part& part) {
  part.phase = *part.timer->next_release();
  part.releases_before = part.received + part.timer->missed();
}

void World::cancel_or_reset() {
  auto* const chosen = any(parts_);
  if (chosen == nullptr || !(*chosen)->timer) return;
  Part& part = **chosen;
  if ((part.is_cancelled = next() % 2 == 0)) {
    part.timer->cancel();
  } else {
    part.timer->reset();
    begin_phase(part);
  }
}

void World::release_at() {
  const PartPtr part = any_with(&Part::timer);
  const std::uint8_t when = next() % 5;
  if (part == nullptr || part->is_for_ever) return;
  const TimePoint times[] = {TimePoint::min(), TimePoint{}, clock_.now(), clock_.now() + 1ms,
                             kNever};
  part->is_irregular = true;
  part->is_cancelled = false;
  part->timer->release_at(times[when]);
}

// From here on only callbacks that are still to come keep the part, and its handles.
void World::abandon() {
  const PartPtr part = next() % 2 == 0 ? any_with(&Part::action_client) : any_with(&Part::client);
  if (part == nullptr) return;
  std::erase(parts_, part);
  abandoned_.push_back(part);
}

void World::drop() {
  if (!parts_.empty()) let_go(parts_[next() % parts_.size()]);
}

void World::let_go(const PartPtr& part) {
  const PartPtr dropped = part;
  std::erase(parts_, dropped);
  dropped->is_dropped = true;
  // Each handle on its own, as a callback that goes with it may look at the part.
  const auto reset = [](auto& handle) { std::exchange(handle, nullptr).reset(); };
  reset(dropped->timer);
  reset(dropped->subscription);
  reset(dropped->guard);
  reset(dropped->service);
  reset(dropped->client);
  reset(dropped->receiver);
  reset(dropped->event);
  reset(dropped->action_server);
  reset(dropped->action_client);
}

// ---- Parameters ----

void World::set_callback_parameters() {
  Place* const place = any(places_);
  if (place == nullptr) return;
  are_equal_ = false;
  CallbackParameters parameters;
  parameters.priority = next() % 4;
  if (next() % 2 == 0) parameters.deadline = kLimits[1 + next() % 5];
  attempt([&] {
    place->node->set_callback_parameters({.callback_groups = {{"default", parameters}}});
  });
}

void World::set_node_parameters() {
  Place* const place = any(places_);
  if (place == nullptr) return;
  const std::int64_t value = next();
  if (value > 250) place->refuses_odd = nullptr;
  const auto before = api_.get_parameter(place->node);
  const bool is_set = api_.set_parameter(place->node, value);
  const bool fits = value <= 100 && (value % 2 == 0 || place->refuses_odd == nullptr);
  demand(is_set == fits, "a parameter was set that does not fit, or was not and does");
  demand(api_.get_parameter(place->node) == (is_set ? value : before),
         "a parameter has another value than was set last");
}

// ---- Lifecycles ----

CallbackReturn Managed::decide() {
  const TransitionResult refused = trigger_transition("shutdown");
  world_.demand(!refused.returned, "a transition began during another");
  switch (world_.next_outcome()) {
    case 5:
      return CallbackReturn::FAILURE;
    case 6:
      return CallbackReturn::ERROR;
    case 7:
      throw Thrown{};
    default:
      return CallbackReturn::SUCCESS;
  }
}

CallbackReturn Managed::on_error(LifecycleState) {
  return decide();
}

void World::request_transition() {
  constexpr const char* kTransitions[] = {"configure", "activate", "deactivate",
                                          "cleanup",   "activate", "shutdown"};
  std::vector<std::shared_ptr<Managed>> nodes;
  for (const Place& place : places_) {
    if (place.lifecycle != nullptr) nodes.push_back(place.lifecycle);
  }
  const std::uint8_t what = next();
  const auto* const node = any(nodes);
  if (node == nullptr) return;
  const char* const wanted = kTransitions[what % std::size(kTransitions)];
  outcome_ = next() % 8;
  second_outcome_ = next() % 8;
  const std::uint8_t outcome = outcome_;
  const auto* const transition = find_transition((*node)->get_current_state(), wanted);
  const TransitionResult result = (*node)->trigger_transition(wanted);
  demand(result.returned.has_value() == (transition != nullptr),
         "a transition was refused that is possible, or was not and is not");
  if (transition == nullptr) return;
  demand(static_cast<bool>(result) == (outcome < 5), "a transition did not end as its callback");
  demand(is_primary((*node)->get_current_state()), "a node rests between two states");
}

}  // namespace takt::sequences
