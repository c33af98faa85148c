// Spins, and what must hold after them.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {
namespace {

constexpr std::uint64_t kMostMissed = std::uint64_t{1} << 62;
// Rounds in which a goal and its result go from one executor to the other and back, though no
// callback of the user runs.
constexpr int kMostHandOvers = 4;

}  // namespace

void World::spin_briefly() {
  const Nanoseconds limit = kLimits[next() % kLimits.size()];
  const bool is_busy = next() % 2 == 0;
  make_busy(is_busy);
  if (is_for_ever(limit) || next() % 2 == 0) {
    rest_endless();
    spin([&] { executor_->spin_some(limit); });
  } else if (limit == Nanoseconds::zero()) {
    spin([&] { executor_->spin_once(limit); });
    demand(runs_ <= 1, "spin_once ran several callbacks");
  } else {
    spin([&] { executor_->spin_all(limit); });
  }
  make_busy(false);
}

void World::spin_until() {
  const Nanoseconds limit = kLimits[1 + next() % 5];
  Promise<int> promise;
  promise_ = &promise;
  // The busy callback makes the future ready, or nobody does, and the limit ends the spin.
  until_done_ = is_for_ever(limit) || next() % 2 == 0 ? 3 : 0;
  make_busy(true);
  FutureReturnCode code{};
  const bool is_awaited = until_done_ != 0;
  const bool is_whole =
      spin([&] { code = executor_->spin_until_future_complete(promise.get_future(), limit); });
  if (is_whole && are_equal_ && is_awaited && is_for_ever(limit)) {
    demand(code == FutureReturnCode::SUCCESS, "a future came, and was not waited for");
  }
  until_done_ = 0;
  make_busy(false);
}

void World::make_busy(bool is_busy) {
  busy_left_ = is_busy ? kMostRuns / 2 : 0;
  if (is_busy) busy_->trigger();
}

void World::release_timers(bool released) {
  executor_->release_timers(released);
  if (other_ != nullptr) other_->release_timers(released);
  are_held_ = !released;
  is_quiet_ = false;
}

// Timers stand still while others are busy; then they go on.
void World::hold_and_release() {
  stop_calls();
  rest_endless();
  release_timers(false);
  make_busy(true);
  spin([&] { executor_->spin_all(1ms); });
  release_timers(true);
  const bool is_whole = spin([&] { executor_->spin_all(20ms); });
  make_busy(false);
  if (!is_whole || !are_equal_) return;
  for (const auto& part : parts_) {
    if (!part->timer || !is_in_executor(*part) || part->is_cancelled) continue;
    if (part->group->is_in_other || part->is_irregular) continue;
    demand(clock_.now() - 10ms < *part->timer->next_release(),
           "a due timer did not run, while others kept the executor busy");
  }
}

// Cancels the timers that are always due.
void World::rest_endless() {
  for (const auto& part : parts_) {
    if (part->timer == nullptr || !part->is_endless) continue;
    part->is_cancelled = true;
    part->timer->cancel();
  }
}

// Until neither executor has anything left to do. False: a spin did not run to its end, or work
// never ended.
bool World::spin_all() {
  int quiet = 0;
  for (int round = 0; round < 100 && quiet < kMostHandOvers; ++round) {
    rest_endless();
    std::size_t runs = 0;
    if (!spin([&] { executor_->spin_all(), runs += runs_; })) return false;
    if (other_ == nullptr) return true;
    if (!spin_other([&] { other_->spin_all(), runs += runs_; })) return false;
    quiet = runs == 0 ? quiet + 1 : 0;
  }
  return quiet == kMostHandOvers;  // false: its timers are as fast as these spins
}

// Much later, nothing waits any more for an object that has gone.
void World::be_patient() {
  stop_calls();
  const TimePoint begin = clock_.now();
  for (int i = 0; i < 2; ++i) {
    clock_.advance(3s);
    settle();
    if (broken_ != nullptr || are_held_ || !spin_all()) return;
  }
  for (const PartPtr& part : parts_) {
    if (part->client != nullptr && is_in_executor(*part)) check_lonely_calls(*part, begin);
  }
  for (const auto& goal : goals_) check_end(*goal, begin);
}

void World::settle() {
  make_busy(false);
  const TimePoint begin = clock_.now();
  if (!spin_all()) return;
  is_quiet_ = are_held_;
  for (const auto& part : parts_) {
    if (is_in_executor(*part)) check_settled(*part, begin);
  }
  for (const auto& goal : goals_) check_goal(*goal);
  if (const char* complaint = witness.complaint) demand(false, complaint);
}

void World::check_settled(const Part& part, TimePoint begin) {
  if (part.timer && !are_held_) check_timer(part, begin);
  if (!are_held_ && is_active(part)) {
    demand(part.sleeps_until > begin, "spin_all left a coroutine that has slept enough");
  }
  const PartPtr awaited = part.awaits.lock();
  demand(awaited == nullptr || !awaited->is_dropped || !is_active(part),
         "a coroutine waits for a receiver that has gone");
  if (part.event) check_event(part);
  if (part.guard) demand(part.guard->ready_count() == 0, "spin_all left a guard condition");
  if (part.client) check_calls(part, begin);
  const SubscriptionBase* receives = part.subscription.get();
  if (part.service) receives = part.service.get();
  if (receives == nullptr) return;
  demand(receives->ready_count() == 0, "spin_all left a message");
  if (part.is_in_task || !is_active(part)) return;  // messages wait
  demand(part.received + receives->lost() == part.published,
         "delivered + dropped is not what was published");
}

void World::check_timer(const Part& part, TimePoint begin) {
  const TimePoint release = *part.timer->next_release();
  demand(release > begin, "spin_all left a due timer");
  demand(part.timer->missed() < kMostMissed, "a timer has missed more than there was");
  if (part.is_irregular || part.is_endless) return;
  if (part.is_managed || part.is_cancelled || part.is_for_ever) return;
  const auto releases = (release - part.phase) / part.timer->period();
  demand(part.received + part.timer->missed() - part.releases_before ==
             static_cast<std::uint64_t>(releases),
         "a timer did not run as often as time says");
}

// While callbacks publish to it and trigger it.
void World::remove_from_another_thread() {
  const Place* const place = any(places_);
  if (place == nullptr) return;
  stop_calls();
  std::atomic<bool> is_removed{false};
  std::thread remover([&] {
    attempt([&] { executor_->remove_node(place->node); });
    is_removed = true;
  });
  while (!is_removed && broken_ == nullptr) {
    busy_left_ = 3;
    touches_ = true;
    busy_->trigger();
    spin([&] { executor_->spin_some(); });
  }
  touches_ = false;
  remover.join();
  touch_all();
  spin([&] { executor_->spin_some(); });
  make_busy(false);
}

void World::touch_all() {
  for (std::size_t topic = 0; topic < publishers_.size(); ++topic) publish(topic);
  for (const auto& part : parts_) {
    if (part->guard) part->guard->trigger();
  }
}

}  // namespace takt::sequences
