// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatching_executor.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

namespace takt {
thread_local constinit DispatchingExecutor* DispatchingExecutor::worker_of_ = nullptr;
thread_local constinit DispatchingExecutor::Spin* DispatchingExecutor::spin_of_ = nullptr;
thread_local constinit TraceRing* DispatchingExecutor::trace_of_ = nullptr;
thread_local constinit std::size_t DispatchingExecutor::place_ = 0;
thread_local constinit bool DispatchingExecutor::runs_again_ = false;

/// Lives as long as a spin, of any kind: there is only one at a time.
class DispatchingExecutor::Spin {
 public:
  /// `has_workers`: the calling thread is the only worker. A pool sets it when all its threads
  /// exist.
  explicit Spin(DispatchingExecutor& executor, bool has_workers = true) : executor_(executor) {
    Logger::instance().start();  // not in the first callback that logs
    const std::lock_guard lock(executor_.control_mutex_);
    if (executor_.spinning_.load()) {
      throw Error("executor '" + executor_.options_.name + "' is spinning already",
                  "in a callback, make it a coroutine and co_await what it waits for");
    }
    if (executor_.backend_ == nullptr) executor_.choose_wait_backend();
    executor_.backend_->prepare();
    if (executor_.has_changes_) executor_.publish_update();
    executor_.spinning_.store(true);
    executor_.was_spun_ = true;
    outer_ = std::exchange(worker_of_, &executor_);
    outer_spin_ = std::exchange(spin_of_, this);
    outer_place_ = std::exchange(place_, 0);
    outer_trace_ =
        std::exchange(trace_of_, executor_.traces_.empty() ? nullptr : executor_.traces_.data());
    const ReadSection registers_this_thread;
    executor_.install_update();
    executor_.ready_.read_clock();
    executor_.has_just_run_ = false;
    // Between two spins no thread has waited for file descriptors.
    if (executor_.watched_.load() != 0) executor_.backend_->look();
    executor_.has_workers_.store(has_workers);
  }
  ~Spin() {
    executor_.has_workers_.store(false);
    executor_.backend_->leave(0);
    const std::lock_guard lock(executor_.control_mutex_);
    executor_.install_update();
    worker_of_ = outer_;
    spin_of_ = outer_spin_;
    place_ = outer_place_;
    trace_of_ = outer_trace_;
    executor_.spinning_.store(false);
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  /// Consumes a cancel that arrived before or during the spin; returns true if there was one.
  bool take_cancel() noexcept { return executor_.cancelled_.exchange(false); }

  DispatchingExecutor* outer() const noexcept { return outer_; }
  const Spin* outer_spin() const noexcept { return outer_spin_; }

 private:
  DispatchingExecutor& executor_;
  DispatchingExecutor* outer_;
  Spin* outer_spin_;
  std::size_t outer_place_;
  TraceRing* outer_trace_;
};

// ---- Dispatch ----

void DispatchingExecutor::cancel() noexcept {
  cancelled_.store(true);
  wake_all();
}

// Called inside a callback, or by a destructor of a worker's thread that ends: so the lock must be
// left. Installs the updates of all executors whose callbacks this thread is in.
void DispatchingExecutor::install_updates_here() noexcept {
  const Spin* spin = spin_of_;
  for (DispatchingExecutor* executor = worker_of_; executor != nullptr;) {
    executor->lock();
    executor->install_update();
    executor->unlock();
    executor = spin != nullptr ? spin->outer() : nullptr;
    if (spin != nullptr) spin = spin->outer_spin();
  }
}

// Sleeping workers are woken for file descriptors. While none sleeps, a busy one polls them from
// time to time; under a manual clock, which does not watch them, at every dispatch.
void DispatchingExecutor::look_at_file_descriptors() noexcept {
  constexpr Nanoseconds kBetweenLooks(50'000);
  const TimePoint now = options_.clock->now();
  if (options_.clock->as_manual() == nullptr && now - last_look_ < kBetweenLooks) return;
  last_look_ = now;
  backend_->look();
}

// The lock is held before and after.
bool DispatchingExecutor::run_next(const ReadySet::Limits& limits) noexcept {
  install_update();
  if (watched_.load(std::memory_order_relaxed) != 0) [[unlikely]]
    look_at_file_descriptors();
  if (let_ != nullptr) [[unlikely]]
    return run_period();
  CallbackRecord* record = ready_.next(limits);
  if (record == nullptr) [[unlikely]]
    return false;
  const ReadyCallback as_picked = *record;
  const TimePoint picked = ready_.now();  // read since the last callback, or the last sleep
  const bool is_checked = record->is_checked;
  if (is_checked) [[unlikely]]
    watch_execution(*record);
  Slot slot;
  slot.sequence = as_picked.sequence;
  const bool is_taken = take(*record, slot);
  execute(*record, as_picked, picked, is_checked, slot, is_taken, nullptr);
  return true;
}

// Called with the lock held, returns without it. From here on a reentrant group's callback may be
// announced and picked again.
bool DispatchingExecutor::take(CallbackRecord& record, Slot& slot) noexcept {
  const bool is_reentrant = record.is_reentrant();
  bool is_taken;
  if (is_reentrant && record.takes_briefly) {
    is_taken = record.entity->take(slot);
  } else {
    pass_on();
    unlock();
    is_taken = record.entity->take(slot);  // it may decode a long message
    if (!is_reentrant) return is_taken;
    lock();
  }
  ready_.taken(record, slot.more);
  pass_on();
  unlock();
  return is_taken;
}

// Runs on the only thread. Publishes the outputs of the period that ends; then takes all inputs of
// the next one, before any callback runs.
bool DispatchingExecutor::run_period() noexcept {
  ready_.read_clock();
  if (let_->next == TimePoint{}) let_->next = later(ready_.now(), let_->period);
  if (ready_.now() < let_->next) return false;
  let_->outputs.publish();
  const auto missed = (ready_.now() - let_->next) / let_->period;
  let_->missed += static_cast<std::uint64_t>(missed);
  let_->next = later(let_->next + missed * let_->period, let_->period);
  ready_.take_snapshot();
  // A callback may install an update, which replaces the vector for the next period.
  const std::shared_ptr<std::vector<Execution>> keeps = let_->taken;
  std::vector<Execution>& executions = *keeps;
  executions.clear();
  while (CallbackRecord* record = ready_.pick({.may_poll = false})) {
    record->state.retain();
    Execution& execution = executions.emplace_back(record, *record, record->is_checked);
    execution.slot.sequence = record->sequence;
    if (record->is_checked) watch_execution(*record);
    execution.is_taken = record->entity->take(execution.slot);
  }
  for (Execution& execution : executions) {
    CallbackRecord& record = *execution.record;
    if (record.state.is_removed()) {  // by one of the callbacks before
      if (execution.is_taken) record.entity->discard(execution.slot);
      record.state.release();
      continue;
    }
    record.exclusion->admit(record);
    record.state.begin();
    if (record.is_reentrant()) ready_.taken(record, execution.slot.more);
    // Its input was taken with those of all others, and has waited since.
    execute(record, execution.as_picked, ready_.now(), execution.is_checked, execution.slot,
            execution.is_taken, &let_->outputs);
    record.state.release();
  }
  return true;
}

// Called without the lock, returns with it. `as_picked`, `is_checked`: as the record was when it
// was picked.
void DispatchingExecutor::execute(CallbackRecord& record, const ReadyCallback& as_picked,
                                  TimePoint picked, bool is_checked, Slot& slot, bool taken,
                                  StagedOutputs* outputs) noexcept {
  if (taken && AbortedInstances::contains(slot.chain_instance) &&
      record.entity->kind() == EntityKind::subscription) {
    discard(record, slot);
    taken = false;
  }
  // A scheduler that looks at times needs no more than when one callback ended and the next one
  // was picked: on one worker that is one reading.
  const bool reads_clock = ready_.exact_time();
  TimePoint start = picked, end = picked;
  Usage used;
  if (taken) {
    const bool is_root = slot.chain_instance == 0;
    const std::uint64_t instance = is_root ? slot.sequence : slot.chain_instance;
    const TimePoint root = is_root ? slot.ready_time : slot.root_release;
    const std::uint64_t path = extend_path(slot.path, record.entity->mark());
    Dispatch dispatch{as_picked.info, instance, root, path, outputs, record.exclusion.get()};
    const Dispatch::Scope scope(dispatch);
    if (is_checked) [[unlikely]]
      record.supervision->running[place_].chain_instance.store(dispatch.chain_instance);
    Usage before;
    if (trace_of_ != nullptr) [[unlikely]]
      before = usage_of_thread();
    // Last before the callback: what is done for it, in no cache, belongs to the latency.
    if (reads_clock && (times_take_ || is_checked) && (is_checked || !starts_at_once(record, slot)))
        [[unlikely]]
      start = options_.clock->now();
    call(record, slot);
    // Before the user's handlers of limits, and before the wait for the lock.
    if (reads_clock || is_checked) [[unlikely]]
      end = options_.clock->now();
    if (trace_of_ != nullptr) [[unlikely]]
      used = usage_of_thread() - before;
    if (is_checked) [[unlikely]]
      check_limits(record, slot, dispatch, start, end);
  } else if (is_checked) {
    record.supervision->running[place_].deadline.store(kNever);
  }
  lock();
  if (taken && options_.statistics != StatisticsLevel::off) ++record.executions;
  if (reads_clock) [[unlikely]] {
    if (shared_ || is_checked || !taken) {
      ready_.read_clock();
    } else {
      ready_.set_now(end);
      has_just_run_ = end - start < kBrief;
    }
    // The time of the dispatch was read after the callback before: what came since then, from
    // another thread, did not wait.
    picked = std::max(picked, slot.ready_time);
    start = std::max(start, picked);
    if (taken && records_times_) record_times(record, slot, picked, start, end);
    if (taken && trace_of_ != nullptr) trace(record, slot, picked, start, end, used);
    ready_.report_execution(record, as_picked, end - start);
  }
  ready_.finished(record, slot.more);
}

// Discards a message of an aborted chain instance.
void DispatchingExecutor::discard(CallbackRecord& record, Slot& slot) noexcept {
  record.entity->discard(slot);
  lock();
  ++record.discarded;
  unlock();
}

// The classes late and too late are those of irobot-ros/ros2-performance: of the message's period
// T, late is more than min(20 % T, 5 ms), too late more than min(T, 50 ms).
void DispatchingExecutor::record_times(CallbackRecord& record, const Slot& slot, TimePoint picked,
                                       TimePoint start, TimePoint end) noexcept {
  CallbackTimes& times = *record.times;
  times.execution.record(end - start);
  if (slot.ready_time == TimePoint{}) return;  // sent before any reader needed its time
  const Nanoseconds latency = start - slot.ready_time;
  times.latency.record(latency);
  if (MessageTimes* const parts = record.message_times.get(); parts != nullptr) {
    parts->waiting.record(picked - slot.ready_time);
    parts->take.record(start - picked);
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

// ---- Spinning ----

void DispatchingExecutor::rethrow() {
  if (exception_ != nullptr) std::rethrow_exception(std::exchange(exception_, nullptr));
}

// The loop of a worker.
void DispatchingExecutor::work(std::size_t index) {
  worker_of_ = this;
  place_ = index;
  if (!traces_.empty()) trace_of_ = &traces_[index];
  { const ReadSection registers_this_thread; }
  backend_->enter(index, threads_[index]);
  const RealtimeScope scope;
  const Nanoseconds cpu_time = thread_cpu_time();
  const TimePoint start = Clock::steady().now();
  lock();
  spin_times_[index] = Nanoseconds::zero();
  ++workers_;
  while (!stopping()) {
    if (!run_next({})) [[unlikely]]
      wait(index, kNever);
  }
  --workers_;
  unlock();
  ThreadStatistics& statistics = thread_statistics_[index];
  if (let_ != nullptr) {
    let_->outputs.publish();
    statistics.missed_periods = let_->missed;
    statistics.dropped_outputs = let_->outputs.dropped();
  }
  statistics.counters = scope.so_far();
  statistics.cpu_time = thread_cpu_time() - cpu_time;
  statistics.wall_time = Clock::steady().now() - start;
  statistics.spin_time = std::min(spin_times_[index], statistics.cpu_time);
  backend_->leave(index);
}

void DispatchingExecutor::spin(const ExceptionHandler& handler) {
  Spin spin(*this, false);
  if (spin.take_cancel()) return;
  const auto forget = [this](void*) { handler_ = nullptr; };
  const std::unique_ptr<void, decltype(forget)> handler_lasts(this, forget);
  handler_ = handler;
  thread_statistics_.assign(threads_.size(), {});
  {
    std::vector<std::unique_ptr<RealtimeThread>> pool;
    try {
      for (std::size_t i = 1; i < threads_.size(); ++i) {
        pool.push_back(std::make_unique<RealtimeThread>(threads_[i], options_.realtime, [this, i] {
          has_workers_.wait(false);  // nothing runs before all threads exist
          work(i);
        }));
        thread_statistics_[i].asked = threads_[i];
        thread_statistics_[i].in_force = pool.back()->state();
      }
      start_worker(0);
    } catch (...) {
      cancel();
      has_workers_.store(true);
      has_workers_.notify_all();
      pool.clear();
      spin.take_cancel();
      throw;
    }
    has_workers_.store(true);
    has_workers_.notify_all();
    work(0);
    wake_all();
  }
  spin.take_cancel();
  rethrow();
}

void DispatchingExecutor::spin_once(Nanoseconds timeout) {
  Spin spin(*this);
  const TimePoint limit = end_of(timeout, options_.clock->now());
  lock();
  while (!stopping() && !run_next({}) && has_time_left(limit) && wait(0, limit)) {
  }
  unlock();
  spin.take_cancel();
  rethrow();
}

bool DispatchingExecutor::run_one() {
  Spin spin(*this);
  lock();
  const bool has_run = run_next({});
  unlock();
  rethrow();
  return has_run;
}

void DispatchingExecutor::spin_some(Nanoseconds max_duration) {
  Spin spin(*this);
  if (spin.take_cancel()) return;
  const TimePoint limit =
      max_duration == Nanoseconds::zero() ? kNever : later(ready_.now(), max_duration);
  lock();
  // Finishes a snapshot that spin_once has left unfinished, instead of taking another.
  if (let_ == nullptr) ready_.take_snapshot();
  const ReadySet::Limits limits{
      .last_sequence = ready_.is_wait_set() ? UINT64_MAX : next_sequence(), .may_poll = false};
  while (!stopping() && run_next(limits)) {
    if (!has_time_left(limit)) break;
  }
  ready_.restore_deferred();
  unlock();
  spin.take_cancel();
  rethrow();
}

void DispatchingExecutor::spin_all(Nanoseconds max_duration) {
  Spin spin(*this);
  if (spin.take_cancel()) return;
  const TimePoint limit =
      max_duration == Nanoseconds::zero() ? kNever : later(ready_.now(), max_duration);
  lock();
  while (!stopping() && run_next({})) {
    if (!has_time_left(limit)) break;
  }
  unlock();
  spin.take_cancel();
  rethrow();
}

// Called with the lock held.
bool DispatchingExecutor::has_time_left(TimePoint limit) noexcept {
  if (limit == kNever) return true;
  ready_.read_clock();
  return ready_.now() < limit;
}

FutureReturnCode DispatchingExecutor::spin_until_complete(FutureState& future,
                                                          Nanoseconds timeout) {
  Spin spin(*this);
  const TimePoint limit = end_of(timeout, options_.clock->now());
  const FutureState::Waiter waiter(future, *this);
  lock();
  while (!stopping() && !future.ready()) {
    const bool has_run = run_next({});
    if (!has_time_left(limit) || (!has_run && !wait(0, limit, &future))) break;
  }
  unlock();
  const bool was_cancelled = spin.take_cancel();
  rethrow();
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return was_cancelled ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

}  // namespace takt
