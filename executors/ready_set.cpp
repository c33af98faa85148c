// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/ready_set.hpp"

#include <algorithm>

#include "takt/base/sequence.hpp"

namespace takt {
namespace {

// Heap order: the timer that is due first in front; of equal ones, the one registered first.
constexpr auto due_later = [](const auto& a, const auto& b) noexcept {
  return a.first != b.first ? a.first > b.first
                            : a.second->description.id > b.second->description.id;
};

}  // namespace

// Removed records stay behind: the plan has no room for them.
void ReadySet::install(ReadyPlan& plan) noexcept {
  for (CallbackRecord* record : plan.removed) record->removed = true;
  const auto keep = [](ReadyCallback& callback) noexcept {
    auto& record = static_cast<CallbackRecord&>(callback);
    if (record.removed) record.let_go();
    return !record.removed;
  };
  waiting_ = 0;
  while (ReadyCallback* callback = scheduler_ != nullptr ? scheduler_->pop() : nullptr) {
    if (!keep(*callback)) continue;
    plan.scheduler->push(*callback);
    ++waiting_;
  }
  scheduler_.swap(plan.scheduler);
  for (auto& [group, parking] : plan.parking) {
    parking = group->set_parking(std::move(parking), keep);
    hand_back(group->unpark());  // the one that was handed back before may have been removed
  }
  plan.timers.clear();
  for (const auto& timer : timers_) {  // within what was reserved
    if (!timer.second->removed) plan.timers.push_back(timer);
  }
  timers_.swap(plan.timers);
  std::make_heap(timers_.begin(), timers_.end(), due_later);

  for (CallbackRecord* record : plan.added) {
    if (record->removed) continue;
    record->entity->attach(*record);
    if (record->is_timer()) {
      arm(*record);
    } else if (record->entity->ready_count() > 0) {
      Arrival arrival{next_sequence(), now_};
      record->entity->front(arrival);
      announce(*record, arrival);
    }
  }
  for (CallbackRecord* record : plan.removed) {
    if (record->executing.load() == 0) {
      record->gone.store(1);
      record->gone.notify_all();
    }
  }
}

// What was announced goes to the scheduler, and timers whose time has changed are armed anew.
void ReadySet::drain_inbox() noexcept {
  for (CallbackRecord* record = inbox_.take_all(); record != nullptr;) {
    CallbackRecord* next = record->inbox_next;
    if (record->is_timer()) {
      // Cleared before the release time is read: who changes it again announces again. Of a
      // removed record this is our last touch.
      const bool is_idle = !record->removed && !record->held.load(std::memory_order_relaxed);
      record->changed.store(false);
      if (is_idle) {
        disarm(*record);
        arm(*record);
      }
    } else if (record->held.load(std::memory_order_relaxed)) {
      record->drained = true;
    } else if (record->removed) {
      record->queued.store(false);  // our last touch of it
    } else {
      record->drained = true;
      record->arrived(record->announced);
      hold(*record);
    }
    record = next;
  }
}

void ReadySet::release_due_timers() noexcept {
  if (timers_stopped_.load(std::memory_order_relaxed)) return;
  if (!exact_time_) read_clock();
  while (!timers_.empty() && timers_.front().first <= now_) {
    auto [due, record] = timers_.front();
    std::pop_heap(timers_.begin(), timers_.end(), due_later);
    timers_.pop_back();
    record->arrived({next_sequence(), due});
    hold(*record);
  }
}

void ReadySet::arm(CallbackRecord& record) noexcept {
  const TimePoint release = *record.entity->next_release();
  if (release == kNever) return;
  timers_.emplace_back(release, &record);
  std::push_heap(timers_.begin(), timers_.end(), due_later);
}

// Linear, for a timer is rarely cancelled, reset or removed while it waits.
void ReadySet::disarm(CallbackRecord& record) noexcept {
  const auto armed = std::find_if(timers_.begin(), timers_.end(),
                                  [&](const auto& timer) { return timer.second == &record; });
  if (armed == timers_.end()) return;
  timers_.erase(armed);
  std::make_heap(timers_.begin(), timers_.end(), due_later);
}

void ReadySet::restore_deferred() noexcept {
  while (deferred_ != nullptr) {
    ReadyCallback* callback = std::exchange(deferred_, deferred_->next);
    auto& record = static_cast<CallbackRecord&>(*callback);
    if (record.removed) {
      record.let_go();
    } else {
      hand_back(callback);
    }
  }
}

}  // namespace takt
