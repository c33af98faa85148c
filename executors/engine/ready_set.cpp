// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/ready_set.hpp"

#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/probes.hpp"

namespace takt::detail {

bool ReadySet::has_another() noexcept {
  if (!selection().is_open()) return false;
  if (keeps_history_) return !queue_.is_empty() || has_more();
  for (;;) {
    take_snapshot();
    const CallbackRecord* const next = queue_.peek();
    if (next == nullptr) return false;
    if (next->exclusion->is_free() && selection().admits(*next)) return true;
    CallbackRecord& first = *queue_.pop();
    if (selection().holds(first)) continue;
    queue_.serve_window_of(first);  // as that worker would
    first.exclusion->park(first);
    first.state.park();
  }
}

std::optional<std::size_t> ReadySet::worker_for_next() noexcept {
  const CallbackRecord* const first = selection().interrupts() ? queue_.peek() : nullptr;
  return first != nullptr ? selection().worker_for(*first) : std::nullopt;
}

// Only the next callback of the order may begin: a later one does not overtake it.
CallbackRecord* ReadySet::next_to_interrupt(const Limits& limits) noexcept {
  for (;;) {
    if (limits.may_poll) take_snapshot();
    if (worker_for_next() != limits.worker) return nullptr;
    CallbackRecord& first = *queue_.pop();
    queue_.serve_window_of(first);
    if (first.exclusion->admit(first)) {
      first.state.begin();
      selection().begin(first, limits.worker);
      return &first;
    }
    first.state.park();
  }
}

// Empties the schedulers before anything changes that they may read, and refills them afterwards.
// Removed records are left out: the update has no room for them.
void ReadySet::install(ScheduleUpdate& update) noexcept {
  restore_deferred();
  queue_.hand_back_all(selection().take_held());
  ReadyCallback* const waited = queue_.take_all();
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
  queue_.exchange(update);
  for_each_remaining(waited, [this](CallbackRecord& record) { queue_.hand_back(record); });
  for (auto& [exclusion, scheduler, parked] : update.parking) {
    if (!update.only_removes) scheduler = exclusion->set_parking(std::move(scheduler));
    for_each_remaining(parked, [to = exclusion](CallbackRecord& record) { to->park(record); });
    queue_.unpark(exclusion->unpark());  // the one handed back before may have been removed
  }
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
  if (!record.is_reentrant()) queue_.unpark(record.exclusion->leave());
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
      queue_.add(*record);
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
    queue_.push(*record);
  }
}

}  // namespace takt::detail
