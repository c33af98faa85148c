// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/observation.hpp"

namespace takt::detail {
// What waits for a trigger, say, may wait for ever: it is not pending.
bool Observation::is_pending(const CallbackRecord& record) const noexcept {
  // In this order: a thread that sees that a message was taken sees that its callback executes. It
  // reads the entity's kind, because a worker may be changing the record's.
  const bool is_timer = record.entity->kind() == EntityKind::timer;
  const bool has_input = !is_timer && record.entity->ready_count() != 0;
  const bool is_ready = has_input || record.state.state() != RecordState::idle ||
                        (record.is_announced.load() && !is_timer);
  return (is_ready && !is_closed_.load() && !record.is_held.load()) || record.state.is_executing();
}

std::size_t Observation::pending(const CallbackRecords& records) const noexcept {
  std::size_t count = 0;
  for (const auto& [id, record] : records) count += is_pending(*record) ? 1 : 0;
  return count;
}

CallbackStatistics Observation::statistics_of(const CallbackRecord& record) const {
  const bool is_removed = record.state.is_removed();
  // What waits for its trigger, or for a callback that was removed, is not lost.
  const bool may_wait = rule_ != nullptr && rule_->may_hold_for_ever();
  Entity::Counts counts = record.entity_counts(record.state.is_detached(), may_wait || is_removed);
  if (record.entity->kind() == EntityKind::timer && !is_removed) {
    counts.missed += releases_left(*record.entity, timers_held_.load());
  }
  return record.statistics(counts);
}

void Observation::remember(const CallbackRecord& record) {
  if (has_ended_ || !record.is_handed_over) return;
  if (is_traced_ && traced_.size() < kMostTraced) {
    traced_.emplace(record.id(), record);
  }
  if (options_.statistics != StatisticsLevel::off) past_.add(statistics_of(record));
}

std::vector<CallbackStatistics> Observation::statistics(const CallbackRecords& records,
                                                        const RemovedRecords& removed) const {
  std::vector<CallbackStatistics> present;
  present.reserve(records.size());  // of 19 kB each
  for (const auto& [id, record] : records) present.push_back(statistics_of(*record));
  if (options_.statistics == StatisticsLevel::off) return present;
  PastStatistics past = past_;
  for (const auto& record : removed) {
    if (record->entity != nullptr) past.add(statistics_of(*record));
  }
  return past.with(std::move(present));
}

}  // namespace takt::detail
