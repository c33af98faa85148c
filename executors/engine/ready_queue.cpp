// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/ready_queue.hpp"

#include <span>
#include <utility>

namespace takt::detail {

void ReadyQueue::push_checked(CallbackRecord& record) noexcept {
  record.set_urgency();
  const TimePoint deadline = record.deadline_of(record.ready_time);
  if (watchdog_ != nullptr && deadline != kNever && !record.is_dropped())
    record.supervision->wait(deadline, *watchdog_);
  hand_back(record);
}

void ReadyQueue::push_next_snapshot() noexcept {
  const std::span snapshot(next_snapshot_.data(), std::exchange(in_next_snapshot_, 0));
  for (CallbackRecord* record : snapshot) push(*record);
}

void ReadyQueue::hand_back_all(ReadyCallback* first) noexcept {
  while (first != nullptr) hand_back(*std::exchange(first, first->next));
}

ReadyCallback* ReadyQueue::take_all() noexcept {
  ReadyCallback* first = nullptr;
  ReadyCallback** end = &first;
  while (ReadyCallback* callback = scheduler_ != nullptr ? pop() : nullptr) {
    callback->next = nullptr;
    *end = callback;
    end = &callback->next;
  }
  return first;
}

void ReadyQueue::exchange(ScheduleUpdate& update) noexcept {
  if (!update.only_removes) scheduler_.swap(update.scheduler);
  const std::span before(next_snapshot_.data(), std::exchange(in_next_snapshot_, 0));
  for (CallbackRecord* record : before) {
    if (!record->state.is_removed()) add_to_next_snapshot(*record);
  }
  if (update.next_snapshot.size() <= next_snapshot_.size()) return;
  std::copy_n(next_snapshot_.begin(), in_next_snapshot_, update.next_snapshot.begin());
  next_snapshot_.swap(update.next_snapshot);
}

}  // namespace takt::detail
