// A second executor, promises that outlive the spins that wait for them, wait sets, and events.
// SPDX-License-Identifier: Apache-2.0
#include <future>
#include <thread>

#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {
namespace {

constexpr std::size_t kMostPromises = 2, kMostMembers = 4;
// Real times: a spin must see within kPatience that its future has come; when nobody has read the
// clock for kQuiet, a spin counts as asleep.
constexpr auto kPatience = 20s;
constexpr auto kQuiet = 200us;

}  // namespace

// ---- Another executor ----

// Nodes and groups of the old executor are in none afterwards.
void World::renew_other() {
  const auto scheduler_names = schedulers().names();
  const auto executor_names = api_.executor_names();
  ExecutorOptions options;
  const std::string& type = executor_names[next() % executor_names.size()];
  options.scheduler = scheduler_names[next() % scheduler_names.size()];
  if (executors().traits(type).isolates && next() % 2 == 1) {
    options.per = Isolation::group;
    options.reentrant_threads = 2;
  }
  options.clock = &clock_;
  other_.reset();
  for (const PartPtr& part : parts_) {
    if (part->group->is_in_other && part->node.expired()) part->may_be_outside = true;
  }
  attempt([&] {
    other_ = api_.make_executor(type, options);
    other_->release_timers(!are_held_);
  });
}

void World::spin_other_briefly() {
  const Nanoseconds limit = kLimits[next() % kLimits.size()];
  const std::uint8_t way = next() % 3;
  if (other_ == nullptr) return;
  rest_endless();
  if (is_for_ever(limit) || way == 0) {
    spin_other([&] { other_->spin_some(limit); });
  } else if (way == 1) {
    spin_other([&] {
      other_->spin_once(limit);
      demand(runs_ <= 1 || calls_in_callbacks_ != 0, "spin_once ran several callbacks");
    });
  } else {
    spin_other([&] { other_->spin_all(limit); });
  }
}

// ---- Promises ----

void World::keep_promise() {
  if (promises_.size() == kMostPromises) promises_.erase(promises_.begin());
  promises_.push_back(std::make_shared<KeptPromise>());
}

void World::set_promise() {
  if (auto* const kept = any(promises_)) (*kept)->set();
}

void World::wait_for_promise(bool in_callback) {
  const auto* const chosen = any(promises_);
  const Nanoseconds limit = kLimits[next() % kLimits.size()];
  const bool is_other = in_callback || next() % 2 == 0;
  Executor* const executor = is_other ? other_.get() : executor_.get();
  if (chosen == nullptr || executor == nullptr) return;
  const std::shared_ptr<KeptPromise> kept = *chosen;
  if (is_for_ever(limit) && in_callback) return;  // nobody would set it
  const Clock& clock = api_.clock_of_limits(clock_);
  const TimePoint end = later(clock.now(), limit);
  std::optional<FutureReturnCode> code;
  const auto wait = [&] {
    code = executor->spin_until_future_complete(kept->promise.get_future(), limit);
  };
  rest_endless();
  if (is_for_ever(limit)) return set_while_it_sleeps(*kept, *executor, is_other, wait);
  const bool is_whole = is_other ? spin_other(wait) : spin(wait);
  if (!is_whole || !code) return;
  demand((*code == FutureReturnCode::SUCCESS) == kept->is_set, "a spin told a future wrong");
  demand(kept->is_set || clock.now() >= end, "a spin for a future ended before its time");
}

// Another thread sets the promise when nobody has read the clock for a while, as the spin then
// sleeps; or when that has taken long.
template <class Wait>
void World::set_while_it_sleeps(KeptPromise& kept, Executor& executor, bool is_other, Wait&& wait) {
  std::promise<void> ended;
  bool is_late = false;
  std::thread setter([&] {
    std::int64_t before = 0;
    for (int look = 0; look < 20 && before != clock_.trace(); ++look) {
      before = clock_.trace();
      std::this_thread::sleep_for(kQuiet);
    }
    kept.set();
    is_late = ended.get_future().wait_for(kPatience) != std::future_status::ready;
    if (is_late) executor.cancel();
  });
  if (is_other) {
    spin_other(wait);
  } else {
    spin(wait);
  }
  ended.set_value();
  setter.join();
  demand(!is_late, "a spin slept on when the future had come that it waited for");
}

// ---- Wait sets ----

std::shared_ptr<Entity> World::entity_of(const Part& part) {
  if (part.timer != nullptr) return part.timer;
  if (part.subscription != nullptr) return part.subscription;
  if (part.guard != nullptr) return part.guard;
  return part.event;
}

void World::add_to_set() {
  const auto* const chosen = any(parts_);
  if (chosen == nullptr || members_.size() == kMostMembers) return;
  const PartPtr part = *chosen;
  const auto entity = entity_of(*part);
  if (entity == nullptr) return;
  attempt([&] {
    set_.add(entity);
    part->may_be_outside = true;
    members_.emplace_back(part, entity);
  });
}

// The member leaves the model's list first, then the set: its destruction may make a call.
void World::remove_from_set() {
  if (members_.empty()) return;
  const auto place = members_.begin() + next() % members_.size();
  const auto member = *place;
  members_.erase(place);
  set_.remove(member.second);
}

// What is ready is taken, or stays for the next time.
void World::wait_on_set() {
  const Nanoseconds limit = kLimits[next() % kLimits.size()];
  const bool takes = next() % 2 == 0;
  const auto is_ready = [](const auto& member) { return member.second->ready_count() != 0; };
  const bool ends = std::any_of(members_.begin(), members_.end(), is_ready);
  if (waits_on_set_ || (is_for_ever(limit) && !ends)) return;
  waits_on_set_ = true;
  const std::size_t most = members_.size();
  const auto& ready = set_.wait(limit);
  demand(calls_in_destructors_ != 0 || ready.size() <= most, "a set has more than it was given");
  demand(calls_in_destructors_ != 0 || !ends || !ready.empty(), "a set did not see what was ready");
  for (const auto& entity : ready) {
    demand(entity->ready_count() != 0, "a set lists what is not ready");
    Slot slot;
    if (takes && entity->take(slot)) entity->discard(slot);
  }
  waits_on_set_ = false;
}

// ---- Events and lifespans ----

void World::make_event() {
  const std::size_t topic = next() % publishers_.size();
  make_part([&](Place& place, const PartPtr& part, const std::string&) {
    part->event_topic = topic;
    part->event = place.node->create_qos_event<MatchedStatus>(
        *publishers_[topic],
        [this, part](const MatchedStatus& status) {
          MatchedStatus& sum = part->reported;
          sum.total_count += status.total_count_change;
          sum.current_count += status.current_count_change;
          demand(sum.total_count == status.total_count && sum.current_count == status.current_count,
                 "the changes that an event has reported are not what has changed");
          ran(part);
        },
        part->group->group);
    newest_events_[topic] = part;
  });
}

// After a spin that ran to its end.
void World::check_event(const Part& part) {
  if (newest_events_[part.event_topic].lock().get() != &part) return;  // it is not notified
  const MatchedStatus now = publishers_[part.event_topic]->events()->status(MatchedStatus{});
  demand(now.total_count == part.reported.total_count &&
             now.current_count == part.reported.current_count,
         "an event was not reported");
}

// A message whose lifespan is for ever arrives.
void World::publish_lasting() {
  const std::size_t topic = next() % publishers_.size();
  const Nanoseconds lifespan = kDurations[next() % kDurations.size()];
  settle();
  if (broken_ != nullptr) return;
  stop_calls();
  std::vector<std::pair<PartPtr, std::uint64_t>> receivers;
  for (const PartPtr& part : parts_) {
    if (part->subscription == nullptr || part->topic != static_cast<int>(topic)) continue;
    ++part->published;
    if (is_in_executor(*part) && is_active(*part) && !part->is_in_task &&
        part->subscription->ready_count() == 0) {
      receivers.emplace_back(part, part->received);
    }
  }
  const auto publisher =
      source_->create_publisher<Number>(kTopics[topic], QoS(4).lifespan(lifespan));
  publisher->publish(Number{1});
  if (lifespan != 0ns && !is_for_ever(lifespan)) return;
  if (!spin_all()) return;
  for (const auto& [part, before] : receivers) {
    demand(part->received > before, "a message was lost whose lifespan is for ever");
  }
}

}  // namespace takt::sequences
