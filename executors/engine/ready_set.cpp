// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/ready_set.hpp"

#include <span>

#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/probes.hpp"

namespace takt::detail {

bool ReadySet::has_another() noexcept {
  if (!selection_.is_open()) return false;
  if (keeps_history_) return waiting_ != 0 || in_next_snapshot_ != 0 || !inbox_.empty();
  for (;;) {
    take_snapshot();
    ReadyCallback* const first = pop();
    if (first == nullptr) return false;
    auto& record = static_cast<CallbackRecord&>(*first);
    if (selection_.holds(record)) continue;
    Exclusion& exclusion = *record.exclusion;
    if (exclusion.is_free()) {
      hand_back(first);
      return true;
    }
    window_ = std::max(window_, first->window);  // as that worker would
    exclusion.park(*first);
    record.state.park();
  }
}

std::optional<std::size_t> ReadySet::worker_for_next() noexcept {
  ReadyCallback* const first = selection_.interrupts() ? pop() : nullptr;
  if (first == nullptr) return {};
  hand_back(first);
  return selection_.worker_for(static_cast<CallbackRecord&>(*first));
}

// Only the next callback of the order may begin: a later one does not overtake it.
CallbackRecord* ReadySet::next_to_interrupt(const Limits& limits) noexcept {
  while (CallbackRecord* const record = pick(limits)) {
    if (selection_.worker_for(*record) != limits.worker) {
      hand_back(record);
      return nullptr;
    }
    if (record->exclusion->admit(*record)) {
      record->state.begin();
      selection_.begin(*record, limits.worker);
      return record;
    }
    record->state.park();
  }
  return nullptr;
}

// Empties the schedulers before anything changes that they may read, and refills them afterwards.
// Removed records are left out: the update has no room for them.
void ReadySet::install(ScheduleUpdate& update) noexcept {
  restore_deferred();
  restore(selection_.take_held());
  ReadyCallback* first = nullptr;
  ReadyCallback** end = &first;
  while (ReadyCallback* callback = scheduler_ != nullptr ? pop() : nullptr) {
    callback->next = nullptr;
    *end = callback;
    end = &callback->next;
  }
  for (auto& parking : update.parking) parking.parked = parking.exclusion->take_parked();

  for (CallbackRecord* record : update.removed) record->state.remove(record->is_announced);
  for (CallbackRecord* record : update.added) record->set(record->settings);
  for (const auto& [record, settings] : update.changed) {
    if (!record->state.is_removed()) record->set(settings);
  }

  for (const auto& [record, level] : update.levels) record->exclusion->set_ceiling(0);
  for (const auto& [record, level] : update.levels) {
    record->level.store(level);
    if (record->state.is_removed()) continue;
    record->exclusion->set_ceiling(std::max(record->exclusion->ceiling(), level));
  }

  const auto for_each_remaining = [](ReadyCallback* callback, auto&& stays) noexcept {
    while (callback != nullptr) {
      auto& record = static_cast<CallbackRecord&>(*std::exchange(callback, callback->next));
      if (!record.state.is_removed()) stays(record);
    }
  };
  if (!update.only_removes) scheduler_.swap(update.scheduler);
  for_each_remaining(first, [this](CallbackRecord& record) { hand_back(&record); });
  for (auto& [exclusion, scheduler, parked] : update.parking) {
    if (!update.only_removes) scheduler = exclusion->set_parking(std::move(scheduler));
    for_each_remaining(parked, [to = exclusion](CallbackRecord& record) { to->park(record); });
    unpark(exclusion->unpark());  // the one handed back before may have been removed
  }
  exchange_next_snapshot(update);
  timers_.exchange(update.timers, update.removed);

  if (update.reads_clock && !exact_time()) {
    exact_time_.store(true, std::memory_order_relaxed);
    for (CallbackRecord* record : update.all) record->entity->attach(*record);  // now with times
  }
  for (CallbackRecord* record : update.added) {
    if (record->state.is_removed()) continue;
    record->entity->attach(*record);
    if (record->is_timer()) {
      timers_.arm(*record);
    } else if (record->entity->ready_count() > 0) {
      Arrival arrival{next_sequence(), timers_.now()};
      record->entity->front(arrival);
      announce(*record, arrival);
    }
  }
  for (CallbackRecord* record : update.removed) record->leave();
}

void ReadySet::end_removed(CallbackRecord& record) noexcept {
  if (!record.is_reentrant()) unpark(record.exclusion->leave());
  record.state.end_execution();
  record.leave();
}

void ReadySet::discard_removed() noexcept {
  for (CallbackRecord* record = inbox_.take_all(); record != nullptr;) {
    CallbackRecord* const next = record->inbox_next;
    if (!record->state.is_removed()) {
      inbox_.push(*record);
    } else {
      record->state.discard();
      record->leave();  // the last access to it
    }
    record = next;
  }
}

// Keeps the entries that remain; moves them into the update's memory, if that is larger.
void ReadySet::exchange_next_snapshot(ScheduleUpdate& update) noexcept {
  const std::span before(next_snapshot_.data(), std::exchange(in_next_snapshot_, 0));
  for (ReadyCallback* callback : before) {
    if (!static_cast<CallbackRecord*>(callback)->state.is_removed())
      add_to_next_snapshot(*callback);
  }
  if (update.next_snapshot.size() <= next_snapshot_.size()) return;
  std::copy_n(next_snapshot_.begin(), in_next_snapshot_, update.next_snapshot.begin());
  next_snapshot_.swap(update.next_snapshot);
}

void ReadySet::push_checked(CallbackRecord& record) noexcept {
  record.set_urgency();
  const TimePoint deadline = record.deadline_of(record.ready_time);
  if (watchdog_ != nullptr && deadline != kNever && !record.is_dropped())
    record.supervision->wait(deadline, *watchdog_);
  hand_back(&record);
}

void ReadySet::push_next_snapshot() noexcept {
  const std::span snapshot(next_snapshot_.data(), std::exchange(in_next_snapshot_, 0));
  for (ReadyCallback* callback : snapshot) push(static_cast<CallbackRecord&>(*callback));
}

// Moves announced records to the scheduler, or the next snapshot, and rearms timers whose release
// time has changed.
void ReadySet::drain_inbox() noexcept {
  ReadyCallback* changed = nullptr;
  for (CallbackRecord* record = inbox_.take_all(); record != nullptr;) {
    CallbackRecord* next = record->inbox_next;
    if (record->state.is_removed()) {
      record->state.discard();
      record->leave();  // the last access to it
    } else if (record->is_timer() && record->state.state() == RecordState::idle) {
      record->next = std::exchange(changed, record);
    } else if (record->is_timer()) {
      RecordState::set_again(record->is_announced);
    } else if (record->state.drain()) {
      record->arrived(record->announced);
      if (is_wait_set()) {
        add_to_next_snapshot(*record);
      } else {
        push(*record);
      }
    }
    record = next;
  }
  if (changed != nullptr) timers_.rearm(changed);
}

void ReadySet::release_due_timers() noexcept {
  if (!exact_time()) timers_.look_at_clock();  // even if timers are held: it restarts the count
  if (timers_.timers_are_held()) return;
  TimePoint due;
  while (CallbackRecord* const record = timers_.take_due(due)) {
    if (!record->state.make_ready(record->is_announced))
      continue;  // it is in the inbox, and will be set again
    TAKT_PROBE(release, record->entity.get(), record->entity->name().c_str());
    record->arrived({next_sequence(), due});
    push(*record);
  }
}

void ReadySet::restore(ReadyCallback* first) noexcept {
  while (first != nullptr) hand_back(std::exchange(first, first->next));
}

}  // namespace takt::detail
