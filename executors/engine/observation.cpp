// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/observation.hpp"

#include <mutex>
#include <utility>

#include "takt/base/error.hpp"

namespace takt::detail {

Observation::Observation(const ExecutorOptions& options, const Rule* rule,
                         const CallbackLists& lists)
    : options_(options), rule_(rule), lists_(lists), is_traced_(options.trace_events != 0) {
  if (watchdog() != nullptr) watchdog()->add(*this);
}

Observation::~Observation() {
  if (watchdog() != nullptr) watchdog()->remove(*this);
}

// ---- Callbacks ----

// A callback that a rule holds, for a trigger, say, may wait for ever: it is not pending.
bool Observation::is_pending(const CallbackRecord& record) const noexcept {
  // The order matters: a thread that sees a message taken also sees its callback execute. The kind
  // is that of the entity, because a worker may be changing the record's.
  const bool is_timer = record.entity->kind() == EntityKind::timer;
  const bool has_input = !is_timer && record.entity->ready_count() != 0;
  const bool is_ready = has_input || record.state.state() != RecordState::idle ||
                        (record.is_announced.load() && !is_timer);
  return (is_ready && !is_closed_.load() && !record.is_held.load()) || record.state.is_executing();
}

std::size_t Observation::pending() const noexcept {
  const std::lock_guard lock(lists_.mutex);
  std::size_t count = 0;
  for (const auto& [id, record] : lists_.records) count += is_pending(*record) ? 1 : 0;
  return count;
}

CallbackStatistics Observation::statistics_of(const CallbackRecord& record) const {
  const bool is_removed = record.state.is_removed();
  // A message that waits for a trigger, or for a callback that was removed, is not lost.
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

std::vector<CallbackStatistics> Observation::statistics() const {
  const std::lock_guard lock(lists_.mutex);
  std::vector<CallbackStatistics> present;
  present.reserve(lists_.records.size());  // of 19 kB each
  for (const auto& [id, record] : lists_.records) present.push_back(statistics_of(*record));
  if (options_.statistics == StatisticsLevel::off) return present;
  PastStatistics past = past_;
  for (const auto& record : lists_.removed) past.add(statistics_of(*record));
  return past.with(std::move(present));
}

// Runs on the watchdog's thread. The handler runs without the mutex and may destroy this object
// (under `isolated`, a handler that removes its own node does), so nothing of it is used
// afterwards.
std::optional<TimePoint> Observation::report_miss(TimePoint now) noexcept {
  Supervision::Miss miss;
  {
    const std::lock_guard lock(lists_.mutex);
    for (const auto& [id, record] : lists_.records) {
      if (Supervision::find_miss(record->supervision, record->wanted.overrun, now, miss)) break;
    }
  }
  if (miss.late == nullptr) return miss.next;
  Supervision::report(miss);
  return {};
}

// ---- Threads ----

void Observation::add_trace(const Worker& worker, ThreadStatistics& to) const {
  for (const TraceEvent& event : worker.trace.events()) {
    if (const auto present = lists_.records.find(event.callback); present != lists_.records.end()) {
      const Traced traced(*present->second);
      to.trace.push_back(named(event, &traced));
    } else {
      const auto gone = traced_.find(event.callback);
      to.trace.push_back(named(event, gone != traced_.end() ? &gone->second : nullptr));
    }
  }
  to.trace_overwritten = worker.trace.overwritten();
}

std::vector<ThreadStatistics> Observation::thread_statistics(const Workers& workers) const {
  const std::lock_guard lock(lists_.mutex);
  if (lists_.is_spinning) {
    throw Error("executor '" + options_.name + "' is spinning",
                "read the statistics of its threads afterwards");
  }
  std::vector<ThreadStatistics> threads = threads_;
  if (options_.trace_events == 0) return threads;
  threads.resize(workers.all().size());
  for (const Worker& worker : workers.all()) add_trace(worker, threads[worker.index]);
  return threads;
}

void Observation::begin_trace(Workers& workers, std::size_t events) {
  check_begin_trace(options_);
  const std::lock_guard lock(lists_.mutex);
  is_traced_ = true;
  for (const auto& [id, record] : lists_.records) record->begin_trace();
  for (Worker& worker : workers.all()) worker.trace.begin(events);
}

void Observation::end_trace(Workers& workers) noexcept {
  const std::lock_guard lock(lists_.mutex);
  if (options_.trace_events != 0) return;
  for (Worker& worker : workers.all()) worker.trace.end();
}

std::vector<ThreadStatistics> Observation::traces(
    const Workers& workers, const std::vector<std::atomic<int>>& threads) const {
  const std::lock_guard lock(lists_.mutex);
  std::vector<ThreadStatistics> traces(workers.all().size());
  for (const Worker& worker : workers.all()) {
    ThreadStatistics& trace = traces[worker.index];
    add_trace(worker, trace);
    trace.asked = worker.attributes;
    if (const int thread = threads[worker.index].load(); thread != 0) {
      trace.in_force = thread_state(thread);
    } else if (!lists_.is_spinning && worker.index < threads_.size()) {
      trace.in_force = threads_[worker.index].in_force;
    }
  }
  return traces;
}

}  // namespace takt::detail
