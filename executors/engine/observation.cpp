// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/observation.hpp"

#include <algorithm>

#include <sys/resource.h>

#include "takt/base/logger.hpp"
#include "takt/executors/latency_slices.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt::detail {
namespace {

// Limit: removed callbacks that an executor names in its trace. At it: the others are "(removed)".
// Seen: in the trace.
constexpr std::size_t kMostTraced = 10'000;

// The releases of a timer that were due when timers were held, and that nobody has taken: of one
// that others keep from running all the time no execution tells.
std::uint64_t releases_left(const Entity& timer, TimePoint held) noexcept {
  const TimePoint due = timer.next_release().value_or(kNever);
  return due > held ? 0 : static_cast<std::uint64_t>((held - due) / timer.period()) + 1;
}

}  // namespace

// ---- Times and traces ----

// The classes late and too late are those of irobot-ros/ros2-performance: of the message's period
// T, late is more than min(20 % T, 5 ms), too late more than min(T, 50 ms).
void Observation::record_times(CallbackRecord& record, const Slot& slot,
                               const ExecutionTimes& at) noexcept {
  CallbackTimes& times = *record.times;
  times.execution.record(at.end - at.start);
  if (slot.ready_time == TimePoint{}) return;  // sent before any reader needed its time
  const Nanoseconds latency = at.start - slot.ready_time;
  times.latency.record(latency);
  if (MessageTimes* const parts = record.message_times.get(); parts != nullptr) {
    parts->waiting.record(at.picked - slot.ready_time);
    parts->take.record(at.start - at.picked);
    if (options_.slices != nullptr) options_.slices->record(at.start, latency);
  }
  const Nanoseconds period = slot.expected_period;
  if (period == Nanoseconds::zero() || record.is_timer()) return;
  ++record.counts.with_period;
  if (latency > std::min<Nanoseconds>(period, std::chrono::milliseconds(50))) {
    ++record.counts.too_late;
  } else if (latency > std::min<Nanoseconds>(period / 5, std::chrono::milliseconds(5))) {
    ++record.counts.late;
  }
}

ThreadUsage Observation::usage_of_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {thread_cpu_time(), usage.ru_nvcsw};
}

void Observation::trace(Worker& worker, CallbackRecord& record, const Slot& slot,
                        const ExecutionTimes& times) noexcept {
  const std::uint64_t lost = record.entity->lost();
  worker.trace->record({.callback = record.id(),
                        .sequence = slot.sequence,
                        .chain_instance = slot.chain_instance == 0
                                              ? slot.sequence
                                              : instance_before_joins(slot.chain_instance),
                        .path = extend_path(slot.path, record.entity->mark()),
                        .lost = lost - std::exchange(record.lost_before, lost),
                        .ready = slot.ready_time == TimePoint{} ? times.picked : slot.ready_time,
                        .picked = times.picked,
                        .start = times.start,
                        .end = times.end,
                        .cpu_time = times.used.cpu_time,
                        .has_waited = times.used.waits != 0});
}

// ---- Limits ----

// The watchdog may have looked while the deadline moved from the release to the execution, so it is
// expected again.
void Observation::watch_execution(CallbackRecord& record, const Worker& worker) noexcept {
  const TimePoint deadline = record.supervision->begin(worker.index).deadline.load();
  if (options_.watchdog != nullptr && deadline != kNever) options_.watchdog->expect(deadline);
}

void Observation::check_limits(DispatchLock& dispatch_lock, const Worker& worker,
                               Execution& execution, const Dispatch& dispatch,
                               const ExecutionTimes& times) {
  CallbackRecord& record = *execution.record;
  const Slot& slot = execution.slot;
  const TimePoint start = times.start, end = times.end;
  Supervision& supervision = *record.supervision;
  Supervision::Watch& watch = supervision.running[worker.index];
  watch.chain_instance.store(0);
  // The thread that clears the deadline reports the miss.
  const bool is_reported = watch.is_watched && watch.deadline.exchange(kNever) == kNever;
  dispatch_lock.lock();
  const Nanoseconds budget = record.settings.info.budget;
  const TimePoint deadline = record.deadline_of(slot.ready_time);
  const bool has_missed = end > deadline;
  const bool is_over_budget = budget != Nanoseconds::zero() && end - start > budget;
  const bool has_overrun =
      is_over_budget || (record.is_timer() && record.entity->next_release() < end);
  if (has_missed) ++record.counts.deadline_misses;
  if (is_over_budget) ++record.counts.overruns;
  const bool is_bad = has_missed || has_overrun;
  const OverrunPolicy policy = record.settings.overrun;
  record.is_demoted = is_bad && policy == OverrunPolicy::demote;
  if (is_bad && policy == OverrunPolicy::skip) record.entity->skip_releases(end);
  const bool is_aborted = is_bad && policy == OverrunPolicy::abort;
  if (is_aborted) AbortedInstances::add(dispatch.chain_instance);
  for (const ChainStep& step : record.entity->chain_steps()) {
    const std::optional<TimePoint> root = root_release(dispatch, step.path);
    if (!root) continue;  // it came on another path
    if (step.is_last) {
      step.chain->finished(end - *root);
    } else if (is_aborted) {
      step.chain->aborted();
    }
  }
  dispatch_lock.unlock();
  OverrunReport report{.node = supervision.node,
                       .callback = supervision.callback,
                       .sequence = slot.sequence,
                       .ready_time = slot.ready_time,
                       .deadline = deadline,
                       .end = end,
                       .execution_time = end - start,
                       .budget = budget};
  if (has_missed && !is_reported && supervision.on_deadline_miss)
    supervision.on_deadline_miss(report);
  if (has_overrun && supervision.on_overrun) supervision.on_overrun(report);
}

bool Observation::find_miss(const CallbackRecord& record, TimePoint now, Miss& miss) noexcept {
  Supervision& supervision = *record.supervision;
  const auto has_missed = [&](Supervision::Watch& watch) {
    TimePoint deadline = watch.deadline.load();
    miss.next = std::min(miss.next, deadline > now ? deadline : kNever);
    // If this fails, the execution has just ended; if it has begun again, the watchdog expects it.
    if (deadline > now || !watch.deadline.compare_exchange_strong(deadline, kNever)) return false;
    const std::uint64_t chain_instance = watch.chain_instance.load();
    if (chain_instance != 0 && record.wanted.overrun == OverrunPolicy::abort) {
      AbortedInstances::add(chain_instance);
    }
    miss.missed = deadline;
    return supervision.on_deadline_miss != nullptr;
  };
  if (!has_missed(supervision.waiting) &&
      std::none_of(supervision.running.begin(), supervision.running.end(), has_missed)) {
    return false;
  }
  miss.late = record.supervision;
  return true;
}

void Observation::report(const Miss& miss) noexcept {
  const Supervision& late = *miss.late;
  try {
    late.on_deadline_miss({.node = late.node, .callback = late.callback, .deadline = miss.missed});
  } catch (...) {
    log(LogLevel::error, "{}/{}: on_deadline_miss threw, on the thread `watchdog`", late.node,
        late.callback);
  }
}

// ---- Statistics ----

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

// A worker may be changing the record's settings, so they are not read.
CallbackStatistics Observation::statistics_of(const CallbackRecord& record) const {
  CallbackStatistics statistics;
  const bool is_timer = record.entity->kind() == EntityKind::timer;
  statistics.received = record.counts.executions;
  statistics.with_period = record.counts.with_period;
  statistics.late = record.counts.late;
  statistics.too_late = record.counts.too_late;
  statistics.deadline_misses = record.counts.deadline_misses;
  statistics.overruns = record.counts.overruns;
  if (record.times != nullptr) static_cast<CallbackTimes&>(statistics) = *record.times;
  if (record.message_times != nullptr) {
    static_cast<MessageTimes&>(statistics) = *record.message_times;
  }
  const bool is_removed = record.state.is_removed();
  // What waits for its trigger, or for a callback that was removed, is not lost.
  const bool may_wait = rule_ != nullptr && rule_->may_hold_for_ever();
  const Entity::Counts counts = record.entity_counts(may_wait || is_removed);
  statistics.node = record.node;
  statistics.group = record.group->name();
  statistics.callback = record.entity->name();
  statistics.kind = record.entity->kind();
  statistics.topic = record.entity->topic();
  statistics.dropped = counts.dropped + record.counts.discarded;
  statistics.skipped = counts.missed;
  if (is_timer && !is_removed)
    statistics.skipped += releases_left(*record.entity, timers_held_.load());
  statistics.overruns += statistics.skipped;
  statistics.from_outside = counts.from_outside;
  statistics.expected = is_timer ? statistics.received : counts.expected;
  return statistics;
}

Observation::Traced Observation::traced(const CallbackRecord& record) {
  return {record.node + "/" + record.entity->name(), record.entity->kind(), record.entity->mark()};
}

void Observation::remember(const CallbackRecord& record) {
  if (has_ended_ || !record.is_handed_over) return;
  if (options_.trace_events != 0 && traced_.size() < kMostTraced) {
    traced_.emplace(record.id(), traced(record));
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

std::vector<ThreadStatistics> Observation::thread_statistics(const CallbackRecords& records,
                                                             const Workers& workers) const {
  std::vector<ThreadStatistics> threads = threads_;
  if (options_.trace_events == 0) return threads;
  const auto named = [&](const TraceEvent& event) {
    const auto present = records.find(event.callback);
    const auto gone = traced_.find(event.callback);
    if (present == records.end() && gone == traced_.end()) {
      return NamedTraceEvent{event, "(removed)"};
    }
    const Traced of = present != records.end() ? traced(*present->second) : gone->second;
    return NamedTraceEvent{event, of.name, of.kind, retract_path(event.path, of.mark)};
  };
  threads.resize(workers.all().size());
  for (const Worker& worker : workers.all()) {
    ThreadStatistics& thread = threads[worker.index];
    for (const TraceEvent& event : worker.trace->events()) thread.trace.push_back(named(event));
    thread.trace_overwritten = worker.trace->overwritten();
  }
  return threads;
}

}  // namespace takt::detail
