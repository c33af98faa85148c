// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatcher.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "takt/base/held_locks.hpp"
#include "takt/base/probes.hpp"
#include "takt/entities/traced.hpp"
#include "takt/executors/execution_model.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt::detail {
namespace {

// Whether the scheduler has state besides its waiting callbacks, so a pop changes later choices.
bool keeps_history(const std::string& scheduler) {
  const analysis::Order order = schedulers().traits(scheduler).order;
  return order == analysis::Order::arbitrary || order == analysis::Order::in_turns;
}

bool reads_clock(const ExecutorOptions& options, const Rule* rule) {
  return (rule != nullptr && rule->uses_time()) || options.statistics == StatisticsLevel::full ||
         options.trace_events != 0 || options.clock->as_manual() != nullptr ||
         schedulers().traits(options.scheduler).uses_time;
}

// Whether the calling thread is in a callback of the record's mutually exclusive group.
bool waits_for_this_thread(const CallbackRecord& record) noexcept {
  const Dispatch* const inside = Dispatch::current();
  return inside != nullptr && inside->group == record.exclusion.get() && !record.is_reentrant();
}

}  // namespace

Dispatcher::Dispatcher(const ExecutorOptions& options, Readiness readiness,
                       const std::vector<ThreadAttributes>& threads, Rule* rule,
                       const WorkersPolicy* policy, Observation& observation)
    : options_(options),
      rule_(rule),
      observation_(observation),
      model_(options.execution_model),
      counts_allocations_(observation.records_times() && allocations_are_counted()),
      times_take_(threads.size() > 1 || options.trace_events != 0 || observation.records_times()),
      ready_(readiness, *options.clock, reads_clock(options, rule),
             keeps_history(options.scheduler), rule, policy, threads.size(),
             options.watchdog.get()),
      workers_(options, threads, policy, *this, ready_, updates_) {
  if (rule != nullptr) rule_step_.emplace(*rule, *this);
}

// ---- How a callback becomes ready ----

// A callback that has to wait for the announcing callback's group needs no other worker: this one
// finds it when its own callback ends.
void Dispatcher::announce(CallbackRecord& record, const Arrival& arrival) noexcept {
  TAKT_PROBE(release, record.entity.get(), record.entity->name().c_str());
  if (Worker::is_only_one_of(*this)) return ready_.announce_from_worker(record, arrival);
  if (ready_.announce(record, arrival) && !waits_for_this_thread(record))
    workers_.notify_of(record);
}

// ---- How it is dispatched ----

// Flattened: if this calls its steps instead, an empty callback takes 1.06 times as long.
[[gnu::flatten]] bool Dispatcher::run_next(Worker& worker,
                                           const ReadySet::Limits& limits) noexcept {
  install_update();
  if (workers_.places().watch_file_descriptors()) [[unlikely]]
    workers_.look_at_file_descriptors();
  if (rule_step_) [[unlikely]]
    return rule_step_->run_next(worker, limits);
  return run_ready(worker, limits);
}

bool Dispatcher::run_ready(Worker& worker, const ReadySet::Limits& limits) noexcept {
  CallbackRecord* const record = ready_.next(limits);
  if (record == nullptr) [[unlikely]]
    return false;
  Execution execution(*record, ready_.exact_time());
  if (rule_ != nullptr && rule_->uses_time()) [[unlikely]]
    rule_->begins(execution.as_picked->callback, execution.as_picked->label);
  const TimePoint picked =
      ready_.timers().now();  // read since the last callback, or the last sleep
  if (execution.is_checked) [[unlikely]]
    execution.is_dropped = record->watch_execution(worker.index, options_.watchdog.get());
  if (record->is_reentrant()) {
    take(execution);
    workers_.pass_on();
    lock().unlock();
  } else {
    workers_.pass_on();
    lock().unlock();
    execution.is_taken = record->entity->take(execution.slot);  // it may decode a long message
  }
  ExecutionTimes times = run(worker, execution, picked, nullptr);
  lock().lock();
  finish(worker, execution, times);
  return true;
}

// In a reentrant group, with the lock held before and after: from here on the callback may be
// announced and picked again.
void Dispatcher::take(Execution& execution) noexcept {
  CallbackRecord& record = *execution.record;
  if (record.takes_briefly) {
    execution.is_taken = record.entity->take(execution.slot);
  } else {
    workers_.pass_on();
    lock().unlock();
    execution.is_taken = record.entity->take(execution.slot);
    lock().lock();
  }
  ready_.taken(record, execution.slot.more);
}

void Dispatcher::execute(Worker& worker, Execution& execution, StagedOutputs* outputs) noexcept {
  const TimePoint picked = ready_.timers().now();
  lock().unlock();
  ExecutionTimes times = run(worker, execution, picked, outputs);
  lock().lock();
  finish(worker, execution, times);
}

// Without the lock.
ExecutionTimes Dispatcher::run(Worker& worker, Execution& execution, TimePoint picked,
                               StagedOutputs* outputs) noexcept {
  CallbackRecord& record = *execution.record;
  const Slot& slot = execution.slot;
  const bool is_checked = execution.is_checked;
  // A scheduler that uses times needs only the end of one callback and the pick of the next one: on
  // a single worker both are the same clock reading.
  ExecutionTimes times{picked, picked, picked, execution.as_picked.has_value(),
                       worker.trace.is_on()};
  if (execution.is_taken && AbortedInstances::contains(slot.chain_instance) &&
      record.entity->kind() == EntityKind::subscription) {
    discard(execution, record.counts.discarded);
  }
  if (execution.is_taken && execution.is_dropped) [[unlikely]]
    discard(execution, record.dropped_by_mode);
  if (!execution.is_taken) {
    if (is_checked) record.supervision->running[worker.index].deadline.store(kNever);
    return times;
  }
  Dispatch dispatch = record.dispatch(slot, execution.info, outputs, record.exclusion.get());
  const Dispatch::Scope scope(dispatch);
  if (is_checked) [[unlikely]]
    record.begin_checked(worker.index, dispatch);
  ThreadUsage before;
  if (times.is_traced) [[unlikely]]
    before = ThreadUsage::now();
  if (model_ != nullptr) [[unlikely]]
    model_->dispatch();
  // The last step before the callback, so that the latency includes the work above and its cache
  // misses.
  if (times.are_read && (is_checked || (times_take_ && !starts_at_once(times, execution))))
      [[unlikely]]
    times.start = options_.clock->now();
  call(execution);
  // Before the user's handlers of limits, and before the wait for the lock.
  if (times.are_read || is_checked) [[unlikely]]
    times.end = options_.clock->now();
  if (counts_allocations_) [[unlikely]]  // since the last callback: read once, as it takes 1 ns
    times.allocations = worker.take_allocations();
  if (times.is_traced) [[unlikely]]
    times.used = ThreadUsage::now() - before;
  if (is_checked) [[unlikely]] {
    try {
      record.check_limits(lock(), worker.index, slot, dispatch, times);
    } catch (...) {
      caught(record, std::current_exception());
    }
  }
  return times;
}

void Dispatcher::call(Execution& execution) noexcept {
  try {
    expect_no_lock("callback");
    const TracedCallback traced(*execution.record->entity, execution.slot);
    Entity& entity = *execution.record->entity;
    if (model_ != nullptr) [[unlikely]]
      return model_->execute(entity, execution.slot);
    entity.execute(execution.slot);
  } catch (...) {
    caught(*execution.record, std::current_exception());
  }
}

// With the lock.
void Dispatcher::finish(Worker& worker, Execution& execution, ExecutionTimes& times) noexcept {
  CallbackRecord& record = *execution.record;
  const bool is_taken = execution.is_taken;
  if (is_taken && options_.statistics != StatisticsLevel::off) ++record.counts.executions;
  if (times.are_read) [[unlikely]] {
    if (lock().is_shared() || execution.is_checked || !is_taken) {
      ready_.timers().read_clock();
    } else {
      ready_.timers().set_now(times.end);
      has_just_run_ = times.end - times.start < kBrief;
    }
    // `picked` was read when the previous callback ended: a message that another thread has sent
    // since then has not waited.
    times.picked = std::max(times.picked, execution.slot.ready_time);
    times.start = std::max(times.start, times.picked);
    if (is_taken && observation_.records_times())
      record.record_times(execution.slot, times, options_.slices.get());
    if (is_taken && times.is_traced) record.trace(worker.trace, execution.slot, times);
    const auto& [callback, label] = *execution.as_picked;
    ready_.report_execution(record, callback, times.end - times.start);
    if (rule_ != nullptr && rule_->uses_time())
      rule_->done(callback, label, times.end - times.start);
  }
  if (ready_.selection().interrupts()) [[unlikely]]
    ready_.selection().end(worker.index);
  ready_.finished(record, execution.slot.more);
}

// With one worker, right after a brief callback, when only a pointer was taken: the end of that
// callback serves as the start of this one, without a clock reading.
bool Dispatcher::starts_at_once(const ExecutionTimes& times,
                                const Execution& execution) const noexcept {
  return !workers_.lock().is_shared() && has_just_run_ && !times.is_traced &&
         execution.record->settings.info.kind == EntityKind::subscription &&
         execution.slot.message->origin.writer == 0;
}

// ---- What is rare ----

// Drops a message of an aborted chain instance, or an input that a mode drops.
void Dispatcher::discard(Execution& execution, Counter<>& counted) noexcept {
  execution.record->entity->discard(execution.slot);
  execution.is_taken = false;
  const std::lock_guard guard(lock());
  ++counted;
}

// Gives the exception of a callback to the user's handler, or ends spin with it.
void Dispatcher::caught(const CallbackRecord& record, std::exception_ptr exception) noexcept {
  if (handler_ != nullptr && *handler_ &&
      (*handler_)({record.node, record.entity->name(), exception}))
    return;
  {
    const std::lock_guard guard(lock());
    if (exception_ == nullptr) exception_ = exception;
  }
  workers_.stop();
}

void Dispatcher::rethrow() {
  std::exception_ptr exception;
  {
    const std::lock_guard guard(lock());
    exception = std::exchange(exception_, nullptr);
  }
  if (exception != nullptr) std::rethrow_exception(exception);
}

void Dispatcher::install_pending_update() noexcept {
  ScheduleUpdate* const update = updates_.take_back().release();
  if (update == nullptr) return;
  ready_.install(*update);
  if (rule_step_) rule_step_->install(*update);
  updates_.give_back(*update);
}

// Called inside a callback, or by a thread-local destructor when a worker's thread ends: in both
// the thread does not hold the dispatch lock.
void Dispatcher::install_updates_here() noexcept {
  for (Worker* worker = Worker::current(); worker != nullptr; worker = worker->outer)
    worker->dispatcher->install_here();
}

void Dispatcher::begin() noexcept {
  const std::lock_guard guard(lock());
  ready_.timers().read_clock();
  has_just_run_ = false;
  // Between two spins no thread has waited for file descriptors.
  if (workers_.places().watch_file_descriptors()) workers_.places().look();
}

}  // namespace takt::detail
