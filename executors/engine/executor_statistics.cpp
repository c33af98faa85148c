// What an executor has counted and measured.
// SPDX-License-Identifier: Apache-2.0
#include <mutex>

#include <sys/resource.h>

#include "takt/base/error.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt {
namespace {

// The releases of a timer that were due when timers were held, and that nobody has taken: of one
// that others keep from running all the time no execution tells.
std::uint64_t releases_left(const Entity& timer, TimePoint held) noexcept {
  const TimePoint due = timer.next_release().value_or(kNever);
  return due > held ? 0 : static_cast<std::uint64_t>((held - due) / timer.period()) + 1;
}

}  // namespace

// What waits for a trigger may wait for ever: it is not pending.
std::size_t DispatchingExecutor::pending() const noexcept {
  const std::lock_guard lock(control_mutex_);
  const bool waits = trigger_ != nullptr && !ready_.is_open();
  std::size_t count = let_ != nullptr ? let_->outputs.size() : 0;
  for (const auto& [id, record] : records_) {
    // In this order: a thread that sees that a message was taken sees that its callback executes.
    // It reads the entity's kind, because a worker may be changing the record's.
    const bool is_timer = record->entity->kind() == EntityKind::timer;
    const bool has_input = !is_timer && record->entity->ready_count() != 0;
    const bool is_ready = has_input || record->state.state() != detail::RecordState::idle ||
                          (record->is_announced.load() && !is_timer);
    if ((is_ready && !waits) || record->state.is_executing()) ++count;
  }
  return count;
}

// Only for a record that is not executing.
CallbackStatistics DispatchingExecutor::statistics_of(const Record& record) const {
  CallbackStatistics statistics;
  static_cast<CallbackCounts&>(statistics) = record.counts;
  statistics.received = record.executions;
  if (record.times != nullptr) static_cast<CallbackTimes&>(statistics) = *record.times;
  if (record.message_times != nullptr) {
    static_cast<MessageTimes&>(statistics) = *record.message_times;
  }
  const Entity::Report report = record.entity->report();
  statistics.node = record.node;
  statistics.group = record.group->name();
  statistics.callback = record.entity->name();
  statistics.kind = record.settings.info.kind;
  statistics.topic = report.topic;
  statistics.dropped = report.dropped + record.discarded;
  statistics.skipped = report.missed;
  if (record.is_timer() && !record.state.is_removed())
    statistics.skipped += releases_left(*record.entity, timers_held_.load());
  statistics.overruns += statistics.skipped;
  statistics.from_outside = report.from_outside;
  statistics.expected = record.is_timer() ? statistics.received : report.expected;
  // What waits for its trigger, or for a callback that was removed, is not lost.
  if ((trigger_ != nullptr || record.state.is_removed()) && !record.is_timer()) {
    statistics.expected -=
        std::min(statistics.expected, std::uint64_t(record.entity->ready_count()));
  }
  return statistics;
}

std::vector<CallbackStatistics> DispatchingExecutor::statistics() const {
  const std::lock_guard lock(control_mutex_);
  if (spinning_.load()) {
    throw Error("executor '" + options_.name + "' is spinning", "read its statistics afterwards");
  }
  std::vector<CallbackStatistics> result;
  result.reserve(records_.size());  // of 19 kB each
  for (const auto& [id, record] : records_) result.push_back(statistics_of(*record));
  if (options_.statistics == StatisticsLevel::off) return result;
  detail::PastStatistics past = past_;
  for (const auto& record : removed_) {
    if (record->entity != nullptr) past.add(statistics_of(*record));
  }
  return past.with(std::move(result));
}

DispatchingExecutor::Usage DispatchingExecutor::usage_of_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {thread_cpu_time(), usage.ru_nvcsw};
}

void DispatchingExecutor::trace(CallbackRecord& record, const Slot& slot, TimePoint picked,
                                TimePoint start, TimePoint end, const Usage& used) noexcept {
  const std::uint64_t lost = record.entity->lost();
  trace_of_->record({.callback = record.id(),
                     .sequence = slot.sequence,
                     .chain_instance = slot.chain_instance == 0
                                           ? slot.sequence
                                           : instance_before_joins(slot.chain_instance),
                     .path = extend_path(slot.path, record.entity->mark()),
                     .lost = lost - std::exchange(record.lost_before, lost),
                     .ready = slot.ready_time == TimePoint{} ? picked : slot.ready_time,
                     .picked = picked,
                     .start = start,
                     .end = end,
                     .cpu_time = used.cpu_time,
                     .has_waited = used.waits != 0});
}

std::vector<ThreadStatistics> DispatchingExecutor::thread_statistics() const {
  const std::lock_guard lock(control_mutex_);
  if (spinning_.load()) {
    throw Error("executor '" + options_.name + "' is spinning", "read its statistics afterwards");
  }
  std::vector<ThreadStatistics> threads = thread_statistics_;
  if (traces_.empty()) return threads;
  threads.resize(threads_.size());  // when spin_some or the like ran the callbacks
  const auto named = [this](const TraceEvent& event) {
    NamedTraceEvent result{event, "(removed)"};
    if (const auto found = records_.find(event.callback); found != records_.end()) {
      const Record& record = *found->second;
      result.name = record.node + "/" + record.entity->name();
      result.kind = record.settings.info.kind;
      result.cause = retract_path(event.path, record.entity->mark());
    }
    return result;
  };
  for (std::size_t i = 0; i < traces_.size(); ++i) {
    for (const TraceEvent& event : traces_[i].events()) threads[i].trace.push_back(named(event));
    threads[i].trace_overwritten = traces_[i].overwritten();
  }
  return threads;
}

}  // namespace takt
