// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/ready_set.hpp"

#include <algorithm>
#include <limits>
#include <span>

#include "takt/base/lockfree/sequence.hpp"

namespace takt::detail {
namespace {

// Heap order: the timer that is due first in front; of equal ones, the one registered first.
constexpr auto due_later = [](const auto& a, const auto& b) noexcept {
  return a.first != b.first ? a.first > b.first : a.second->id() > b.second->id();
};

}  // namespace

bool ReadySet::has_another() noexcept {
  if (keeps_history_) return waiting_ != 0 || in_next_snapshot_ != 0 || !inbox_.empty();
  for (;;) {
    take_snapshot();
    ReadyCallback* const first = pop();
    if (first == nullptr) return false;
    Exclusion& exclusion = *static_cast<CallbackRecord&>(*first).exclusion;
    if (exclusion.is_free()) {
      hand_back(first);
      return true;
    }
    exclusion.park(*first);
    static_cast<CallbackRecord*>(first)->state.park();
  }
}

// Empties the schedulers before anything changes that they may read, and refills them afterwards.
// Removed records are left out: the update has no room for them.
void ReadySet::install(ScheduleUpdate& update) noexcept {
  restore_deferred();
  ReadyCallback* first = nullptr;
  ReadyCallback** end = &first;
  while (ReadyCallback* callback = scheduler_ != nullptr ? pop() : nullptr) {
    callback->next = nullptr;
    *end = callback;
    end = &callback->next;
  }
  for (auto& parking : update.parking) parking.parked = parking.exclusion->take_parked();

  for (CallbackRecord* record : update.removed) record->state.remove(record->is_announced);
  for (CallbackRecord* record : update.added) set(*record, record->settings);
  for (const auto& [record, settings] : update.changed) {
    if (!record->state.is_removed()) set(*record, settings);
  }

  const auto for_each_remaining = [](ReadyCallback* callback, auto&& stays) noexcept {
    while (callback != nullptr) {
      auto& record = static_cast<CallbackRecord&>(*std::exchange(callback, callback->next));
      if (!record.state.is_removed()) stays(record);
    }
  };
  if (update.scheduler != nullptr) scheduler_.swap(update.scheduler);
  for_each_remaining(first, [this](CallbackRecord& record) { hand_back(&record); });
  for (auto& [exclusion, scheduler, parked] : update.parking) {
    if (scheduler != nullptr) scheduler = exclusion->set_parking(std::move(scheduler));
    for_each_remaining(parked, [to = exclusion](CallbackRecord& record) { to->park(record); });
    unpark(exclusion->unpark());  // the one handed back before may have been removed
  }
  exchange_next_snapshot(update);
  exchange_timers(update);

  if (update.reads_clock && !exact_time()) {
    exact_time_.store(true, std::memory_order_relaxed);
    for (CallbackRecord* record : update.all) record->entity->attach(*record);  // now with times
  }
  for (CallbackRecord* record : update.added) {
    if (record->state.is_removed()) continue;
    record->entity->attach(*record);
    if (record->is_timer()) {
      arm(*record);
    } else if (record->entity->ready_count() > 0) {
      Arrival arrival{next_sequence(), now_};
      record->entity->front(arrival);
      announce(*record, arrival);
    }
  }
  for (CallbackRecord* record : update.removed) leave(*record);
}

// A removed record has lost one of what keeps it in the ready set: the lists that an update
// replaces, an execution, or the inbox.
void ReadySet::leave(CallbackRecord& record) noexcept {
  if (!record.state.is_over()) return;
  record.notify_over();
  if (record.state.has_left()) record.state.release();
}

void ReadySet::end_removed(CallbackRecord& record) noexcept {
  if (!record.is_reentrant()) unpark(record.exclusion->leave());
  record.state.end_execution();
  leave(record);
}

// Keeps what remains, in the memory that the update has brought.
void ReadySet::exchange_next_snapshot(ScheduleUpdate& update) noexcept {
  next_snapshot_.swap(update.next_snapshot);
  const std::span before(update.next_snapshot.data(), std::exchange(in_next_snapshot_, 0));
  for (ReadyCallback* callback : before) {
    if (!static_cast<CallbackRecord*>(callback)->state.is_removed())
      add_to_next_snapshot(*callback);
  }
}

// Keeps the timers that remain, in the memory that the update has brought.
void ReadySet::exchange_timers(ScheduleUpdate& update) noexcept {
  update.timers.clear();
  for (const auto& timer : timers_) {  // within the reserved capacity
    if (!timer.second->state.is_removed()) update.timers.push_back(timer);
  }
  timers_.swap(update.timers);
  std::make_heap(timers_.begin(), timers_.end(), due_later);
}

// The record must be in no scheduler.
void ReadySet::set(CallbackRecord& record, const CallbackSettings& settings) noexcept {
  record.settings = settings;
  record.demoted_info = settings.info;
  record.demoted_info.priority = std::numeric_limits<int>::min();
  record.demoted_info.criticality = std::numeric_limits<int>::min();
  record.demoted_info.chain = kNoChain;
  record.demoted_info.period = Nanoseconds::zero();
  record.is_checked = must_be_checked(record, settings);
  if (!record.is_checked) record.is_demoted = false;
  set_urgency(record);  // it may be waiting: then it goes back with the new urgency
}

void ReadySet::set_urgency(CallbackRecord& record) noexcept {
  record.info = record.is_demoted ? &record.demoted_info : &record.settings.info;
  record.deadline = record.is_demoted ? kNever : record.deadline_of(record.ready_time);
}

void ReadySet::push_checked(CallbackRecord& record) noexcept {
  set_urgency(record);
  const TimePoint deadline = record.deadline_of(record.ready_time);
  if (watchdog_ != nullptr && deadline != kNever) {
    record.supervision->waiting.is_watched = true;
    record.supervision->waiting.deadline.store(deadline);
    watchdog_->expect(deadline);
  }
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
      leave(*record);  // the last access to it
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
  if (changed != nullptr) rearm(changed);
}

// A reading of the clock takes nearly half as long as a callback without work, so they are paced:
// the number of dispatches between two looks follows the time that they took so far.
void ReadySet::look_at_clock() noexcept {
  constexpr std::int64_t kBetweenLooksNs = 2000;
  // A due timer waits for as many, if brief callbacks have suddenly become long.
  constexpr std::int64_t kMostBetweenLooks = 16;
  const TimePoint before = now_;
  read_clock();
  if (dispatches_until_look_ == 0) {
    const std::int64_t elapsed_ns = std::max<std::int64_t>((now_ - before).count(), 1);
    dispatches_between_looks_ = static_cast<std::uint32_t>(std::clamp<std::int64_t>(
        dispatches_between_looks_ * kBetweenLooksNs / elapsed_ns, 1, kMostBetweenLooks));
  }
  dispatches_until_look_ = dispatches_between_looks_;
}

void ReadySet::release_due_timers() noexcept {
  if (!exact_time()) look_at_clock();  // even if stopped: it restarts the count to the next look
  if (timers_stopped_.load(std::memory_order_relaxed)) return;
  while (!timers_.empty() && timers_.front().first <= now_) {
    auto [due, record] = timers_.front();
    std::pop_heap(timers_.begin(), timers_.end(), due_later);
    timers_.pop_back();
    if (!record->state.make_ready(record->is_announced))
      continue;  // it is in the inbox, and will be set again
    record->arrived({next_sequence(), due});
    push(*record);
  }
}

void ReadySet::arm(CallbackRecord& record) noexcept {
  const TimePoint release = *record.entity->next_release();
  if (release == kNever) return;
  timers_.emplace_back(release, &record);
  std::push_heap(timers_.begin(), timers_.end(), due_later);
}

// The heap's second and third entry are enough of an answer: nothing depends on it but how often a
// worker has to be woken.
TimePoint ReadySet::release_beside_first() const noexcept {
  if (next_release() == kNever) return kNever;
  const auto& [release, first] = timers_.front();
  const Nanoseconds period = first->settings.info.period;
  TimePoint result = period == Nanoseconds::zero() ? kNever : later(release, period);
  for (std::size_t i = 1; i < std::min<std::size_t>(timers_.size(), 3); ++i) {
    if (timers_[i].second->exclusion != first->exclusion) {
      result = std::min(result, timers_[i].first);
    }
  }
  return result;
}

// All at once: one by one, n timers that begin together would cost O(n²). One that is announced
// meanwhile goes, too, and comes again when the inbox is drained.
void ReadySet::rearm(ReadyCallback* first) noexcept {
  std::erase_if(timers_, [](const auto& timer) { return timer.second->is_announced.load(); });
  std::make_heap(timers_.begin(), timers_.end(), due_later);
  while (first != nullptr) {
    auto& record = static_cast<CallbackRecord&>(*std::exchange(first, first->next));
    RecordState::set_again(record.is_announced);
    arm(record);
  }
}

void ReadySet::restore_deferred() noexcept {
  while (deferred_ != nullptr) {
    ReadyCallback* callback = std::exchange(deferred_, deferred_->next);
    hand_back(callback);
  }
}

}  // namespace takt::detail
