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

void ReadySet::install(ReadyPlan& plan) noexcept {
  if (scheduler_ != nullptr) {
    while (ReadyCallback* waiting = scheduler_->pop()) plan.scheduler->push(*waiting);
  }
  scheduler_.swap(plan.scheduler);
  for (auto& [group, parking] : plan.parking) parking = group->set_parking(std::move(parking));
  plan.timers.assign(timers_.begin(), timers_.end());  // within what was reserved
  timers_.swap(plan.timers);

  for (CallbackRecord* record : plan.added) {
    record->entity->attach(*record);
    if (record->is_timer()) {
      arm(*record);
    } else if (record->entity->ready_count() > 0) {
      announce(*record);
    }
  }
  for (CallbackRecord* record : plan.removed) {
    record->removed = true;
    if (record->is_timer()) disarm(*record);
    if (record->executing.load() == 0) {
      record->gone.store(1);
      record->gone.notify_all();
    }
  }
}

void ReadySet::poll() noexcept {
  if (is_wait_set()) ++window_;
  for (CallbackRecord* record = inbox_.take_all(); record != nullptr;) {
    CallbackRecord* next = record->inbox_next;
    if (record->is_timer()) {
      // Cleared before the release time is read: who changes it again announces again.
      record->changed.store(false);
      if (!record->removed && !record->queued.load()) {
        disarm(*record);
        arm(*record);
      }
    } else {
      enqueue(*record);
    }
    record = next;
  }
  if (!timers_.empty()) release_due_timers();
}

void ReadySet::release_due_timers() noexcept {
  if (timers_stopped_.load(std::memory_order_relaxed)) return;
  if (!exact_time_) {
    if (waiting_ != 0 && ++dispatches_ % 8 != 0) return;
    read_clock();
  }
  while (!timers_.empty() && timers_.front().first <= now_) {
    auto [due, record] = timers_.front();
    std::pop_heap(timers_.begin(), timers_.end(), due_later);
    timers_.pop_back();
    record->queued.store(true);
    record->sequence = next_sequence();
    record->ready_time = due;
    push(*record);
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

void ReadySet::enqueue(CallbackRecord& record) noexcept {
  if (record.removed) {
    record.queued.store(false);  // our last touch of it
    return;
  }
  if (!record.entity->front(record.sequence, record.ready_time)) record.sequence = next_sequence();
  push(record);
}

void ReadySet::push(CallbackRecord& record) noexcept {
  record.window = window_;
  const Nanoseconds deadline = record.description.deadline;
  record.ReadyCallback::deadline =
      deadline == Nanoseconds::zero() ? kNever : record.ready_time + deadline;
  hand_back(&record);
}

CallbackRecord* ReadySet::next(const Limits& limits) noexcept {
  for (;;) {
    if (limits.may_poll && (!is_wait_set() || waiting_ == 0)) poll();
    ReadyCallback* first = scheduler_->pop();
    if (first == nullptr) return nullptr;
    --waiting_;
    auto& record = static_cast<CallbackRecord&>(*first);
    if (record.removed) {
      hand_back(record.group->unpark());
      record.queued.store(false);  // our last touch of it
    } else if (record.sequence > limits.last_sequence) {
      record.inbox_next = std::exchange(deferred_, &record);
    } else if (record.group->admit(record)) {
      record.executing.store(record.executing.load(std::memory_order_relaxed) + 1);
      return &record;
    }
  }
}

void ReadySet::restore_deferred() noexcept {
  while (deferred_ != nullptr) {
    CallbackRecord* record = std::exchange(deferred_, deferred_->inbox_next);
    hand_back(record);
  }
}

// Back into the scheduler with its old order of arrival.
void ReadySet::hand_back(ReadyCallback* callback) noexcept {
  if (callback == nullptr) return;
  scheduler_->push(*callback);
  ++waiting_;
}

// The record is at nobody's now: queue it again if more is there, else let it be announced. Both
// sides are sequentially consistent: the publisher writes its message and then reads `queued`, we
// write `queued` and then look for messages, so one of the two sees the other.
void ReadySet::settle(CallbackRecord& record) noexcept {
  if (record.removed) {
    record.queued.store(false);
    return;
  }
  if (record.is_timer()) {
    record.queued.store(false);
    disarm(record);  // it may have been armed by a reset meanwhile
    arm(record);
    return;
  }
  if (record.entity->ready_count() == 0) {
    record.queued.store(false);
    if (record.entity->ready_count() == 0 || record.queued.exchange(true)) return;
  }
  if (is_wait_set()) {
    inbox_.push(record);  // for the next snapshot
  } else {
    enqueue(record);
  }
}

void ReadySet::finished(CallbackRecord& record, Nanoseconds execution_time) noexcept {
  scheduler_->done(record, execution_time);
  const std::uint32_t executing = record.executing.load(std::memory_order_relaxed) - 1;
  const bool is_gone = record.removed && executing == 0;
  if (!record.is_reentrant()) settle(record);
  hand_back(record.group->leave());
  record.executing.store(executing);
  if (is_gone) {
    record.gone.store(1);
    record.gone.notify_all();
  }
}

}  // namespace takt
