// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatching_executor.hpp"

#include <algorithm>
#include <mutex>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/tracepoints.hpp"
#include "takt/executors/chain_limits.hpp"
#include "takt/executors/spin_always.hpp"
#include "takt/executors/virtual_cpus.hpp"
#include "takt/sched/threads/memory_lock.hpp"
#include "takt/sched/threads/realtime_thread.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {

using detail::Worker;

namespace {

// The options with the defaults of the traits; under a manual clock without CPUs nothing spins.
ExecutorOptions effective(ExecutorOptions options, const ExecutorTraits& traits) {
  if (options.scheduler.empty()) options.scheduler = traits.scheduler;
  if (options.clock->as_manual() != nullptr && !has_virtual_cpus(*options.clock))
    options.spin = options.early_wake = Nanoseconds::zero();
  return options;
}

// The attributes of each worker's thread, with its name.
std::vector<ThreadAttributes> threads_for(const ExecutorOptions& options,
                                          const ExecutorTraits& traits) {
  std::vector<ThreadAttributes> threads = options.threads;
  if (threads.empty()) {
    threads.resize(traits.pool ? threads_of_pool(*options.clock) : 1);
  }
  if (threads.size() > traits.max_threads) {
    throw Error(fmt::format("executor '{}' was given {} threads", options.name, threads.size()),
                fmt::format("this type takes at most {}", traits.max_threads));
  }
  for (std::size_t i = 0; i < threads.size(); ++i) {
    std::string& name = threads[i].name;
    if (name.empty()) name = i == 0 ? options.name : fmt::format("{}-{}", options.name, i);
    if (!has_virtual_cpus(*options.clock)) threads[i].check();
  }
  if (!has_virtual_cpus(*options.clock)) check_spin(options, threads);
  return threads;
}

std::unique_ptr<Rule> rule_for(const ExecutorOptions& options, const ExecutorTraits& traits) {
  if (options.per != Isolation::node || options.reentrant_threads != 1) {
    throw Error(fmt::format("executor '{}' is of a type that does not isolate", options.name),
                "leave out `per` and `reentrant_threads`, or choose 'isolated'");
  }
  const TriggerOptions& trigger = options.trigger;
  if (!traits.triggered && (trigger.own || trigger.kind != TriggerOptions::Kind::any ||
                            trigger.let_period != Nanoseconds::zero())) {
    throw Error(fmt::format("executor '{}' is of a type without trigger and period", options.name),
                "leave out `trigger` and `let`, or choose 'triggered'");
  }
  if (traits.rule != nullptr) return traits.rule(options);
  return options.limits_chains && traits.max_threads > 1 && !traits.takes_band ? make_chain_limits()
                                                                               : nullptr;
}

std::unique_ptr<WorkersPolicy> policy_for(const ExecutorOptions& options,
                                          const ExecutorTraits& traits) {
  std::unique_ptr<WorkersPolicy> policy =
      traits.workers != nullptr ? traits.workers(options) : nullptr;
  if (policy == nullptr) return policy;
  if (options.spin != Nanoseconds::zero() || options.early_wake != Nanoseconds::zero()) {
    throw Error(fmt::format("executor '{}' tells its threads apart, so none spins for the others",
                            options.name),
                "leave out `spin` and `early_wake`");
  }
  return policy;
}

bool has_time_left(detail::TimerQueue& timers, TimePoint limit) noexcept {
  if (limit == kNever) return true;
  timers.read_clock();
  return timers.now() < limit;
}

}  // namespace

DispatchingExecutor::DispatchingExecutor(const ExecutorOptions& options,
                                         const ExecutorTraits& traits)
    : options_(effective(options, traits)),
      freezes_(traits.frozen),
      rule_(rule_for(options_, traits)),
      policy_(policy_for(options_, traits)),
      observation_(options_, rule_.get(), lists_),
      dispatcher_(options_, traits.readiness, threads_for(options, traits), rule_.get(),
                  policy_.get(), observation_),
      callbacks_(options_, dispatcher_, lists_),
      running_(workers().all().size()) {
  const std::size_t threads = running_.size();
  if (policy_ != nullptr && threads > kMostWorkers) {
    throw Error(fmt::format("executor '{}' has {} threads", options.name, threads),
                fmt::format("this type takes at most {}", kMostWorkers));
  }
  if (rule_ != nullptr && rule_->logical_outputs() && threads > 1) {
    throw Error(fmt::format("executor '{}' has {} threads, and logical execution time",
                            options.name, threads),
                "give it one thread");
  }
}

/// Lives as long as a spin, of any kind: there is only one at a time.
class DispatchingExecutor::Spin {
 public:
  /// Without a handler, the calling thread is the only worker. With one there is a pool, and
  /// has_workers_ is set when all its threads exist.
  explicit Spin(DispatchingExecutor& executor, const ExceptionHandler* handler = nullptr)
      : worker(executor.workers().all().front()), executor_(executor) {
    Logger::instance().start();  // not in the first callback that logs
    executor.callbacks_.begin_spin(worker, executor.freezes_);
    executor.dispatcher_.set_handler(handler);
    executor.workers().set_pool(handler != nullptr);
    executor.has_workers_.store(handler == nullptr);
  }
  ~Spin() {
    executor_.has_workers_.store(false);
    executor_.dispatcher_.set_handler(nullptr);
    executor_.workers().places().backend_of(0).leave(0);
    executor_.workers().set_pool(false);
    executor_.callbacks_.end_spin(worker);
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  /// Consumes a cancel that arrived before or during the spin; returns true if there was one.
  bool take_cancel() noexcept { return executor_.workers().take_stop(); }

  Worker& worker;

 private:
  DispatchingExecutor& executor_;
};

void DispatchingExecutor::release_timers(bool released) noexcept {
  dispatcher_.ready().timers().release_timers(released);
  observation_.release_timers(released);
  workers().wake();  // the worker that waits for the first one must look again
}

std::size_t DispatchingExecutor::pending() const noexcept {
  return observation_.pending() + dispatcher_.held_back();
}

// The loop of a worker.
void DispatchingExecutor::work(Worker& worker) {
  if (worker.index != 0) worker.enter();
  { const ReadSection registers_this_thread; }
  if (const Tracepoints* const points = tracepoints()) points->thread_begins();
  workers().places().backend_of(worker.index).enter(worker.index, worker.attributes);
  running_[worker.index].store(gettid());
  const RealtimeScope scope;
  const Nanoseconds cpu_time = thread_cpu_time();
  const TimePoint start = Clock::steady().now();
  {
    const std::lock_guard lock(dispatcher_.lock());
    workers().begin(worker);
    const detail::ReadySet::Limits limits{.worker = workers().number_of(worker)};
    while (!workers().stopping()) {
      if (!dispatcher_.run_next(worker, limits)) [[unlikely]]
        dispatcher_.wait(worker, kNever);
    }
    workers().end();
  }
  ThreadStatistics& statistics = observation_.threads()[worker.index];
  dispatcher_.end(statistics);
  statistics.counters = scope.so_far();
  statistics.cpu_time = thread_cpu_time() - cpu_time;
  statistics.wall_time = Clock::steady().now() - start;
  statistics.spin_time = std::min(worker.spin_time, statistics.cpu_time);
  running_[worker.index].store(0);
  workers().places().backend_of(worker.index).leave(worker.index);
}

std::vector<int> DispatchingExecutor::running_threads() const {
  std::vector<int> threads;
  for (const std::atomic<int>& thread : running_) {
    if (const int number = thread.load(); number != 0) threads.push_back(number);
  }
  return threads;
}

void DispatchingExecutor::spin(const ExceptionHandler& handler) {
  Spin spin(*this, &handler);
  if (spin.take_cancel()) return;
  const bool asks = !has_virtual_cpus(*options_.clock);
  const Realtime realtime = asks ? options_.realtime : Realtime::off;
  const auto asked_of_system = [asks](const ThreadAttributes& attributes) {
    return asks ? attributes : ThreadAttributes{.name = attributes.name};
  };
  std::vector<ThreadStatistics>& statistics = observation_.threads();
  statistics.assign(workers().all().size(), {});
  const auto start = [this] {
    has_workers_.store(true);
    has_workers_.notify_all();
  };
  {
    std::vector<std::unique_ptr<RealtimeThread>> pool;
    try {
      for (Worker& worker : workers().all()) {
        ThreadStatistics& thread = statistics[worker.index];
        thread.asked = worker.attributes;
        if (worker.index == 0) continue;
        pool.push_back(std::make_unique<RealtimeThread>(asked_of_system(worker.attributes),
                                                        realtime, [this, &worker] {
                                                          has_workers_.wait(false);
                                                          work(worker);
                                                        }));
        thread.in_force = pool.back()->state();
      }
      ThreadStatistics& mine = statistics.front();
      mine.in_force = options_.threads.empty() ? this_thread_state()
                                               : apply(asked_of_system(mine.asked), realtime);
      if (is_realtime(mine.in_force.policy)) prefault_stack();
    } catch (...) {
      cancel();
      start();
      pool.clear();
      spin.take_cancel();
      throw;
    }
    start();  // nothing runs before all threads exist
    work(spin.worker);
    workers().wake_all();
  }
  spin.take_cancel();
  dispatcher_.rethrow();
}

// A spin of the calling thread alone, until `step` returns false. Returns true if it was cancelled.
template <class Step>
bool DispatchingExecutor::spin_here(Step&& step) {
  Spin spin(*this);
  {
    const std::lock_guard lock(dispatcher_.lock());
    while (!workers().stopping() && step(spin.worker)) {
    }
    dispatcher_.ready().restore_deferred();
  }
  const bool was_cancelled = spin.take_cancel();
  dispatcher_.rethrow();
  return was_cancelled;
}

void DispatchingExecutor::spin_once(Nanoseconds timeout) {
  const TimePoint limit = end_of(timeout, options_.clock->now());
  spin_here([&](Worker& worker) TAKT_REQUIRES(dispatcher_.lock()) {
    return !dispatcher_.run_next(worker, {}) &&
           has_time_left(dispatcher_.ready().timers(), limit) && dispatcher_.wait(worker, limit);
  });
}

bool DispatchingExecutor::run_one() {
  bool has_run = false;
  spin_here([&](Worker& worker) TAKT_REQUIRES(dispatcher_.lock()) {
    has_run = dispatcher_.run_next(worker, {});
    return false;
  });
  return has_run;
}

// `max_duration` 0: no limit.
TimePoint DispatchingExecutor::limit_of(Nanoseconds max_duration) const {
  return max_duration == Nanoseconds::zero() ? kNever : later(options_.clock->now(), max_duration);
}

void DispatchingExecutor::spin_some(Nanoseconds max_duration,
                                    const std::atomic<bool>* is_cancelled) {
  const TimePoint limit = limit_of(max_duration);
  std::optional<detail::ReadySet::Limits> limits;
  spin_here([&](Worker& worker) TAKT_REQUIRES(dispatcher_.lock()) {
    if (!limits) {
      // Finishes a snapshot that spin_once has left unfinished, instead of taking another.
      dispatcher_.take_snapshot();
      const bool is_wait_set = dispatcher_.ready().queue().is_wait_set();
      limits = {.last_sequence = is_wait_set ? UINT64_MAX : next_sequence(), .may_poll = false};
    }
    return dispatcher_.run_next(worker, *limits) &&
           has_time_left(dispatcher_.ready().timers(), limit) &&
           (is_cancelled == nullptr || !is_cancelled->load());
  });
}

void DispatchingExecutor::spin_all(Nanoseconds max_duration) {
  const TimePoint limit = limit_of(max_duration);
  spin_here([&](Worker& worker) TAKT_REQUIRES(dispatcher_.lock()) {
    return dispatcher_.run_next(worker, {}) && has_time_left(dispatcher_.ready().timers(), limit);
  });
}

FutureReturnCode DispatchingExecutor::spin_until_complete(FutureState& future,
                                                          Nanoseconds timeout) {
  const TimePoint limit = end_of(timeout, options_.clock->now());
  const FutureState::Waiter waiter(future, workers());
  const bool was_cancelled = spin_here([&](Worker& worker) TAKT_REQUIRES(dispatcher_.lock()) {
    if (future.ready()) return false;
    const bool has_run = dispatcher_.run_next(worker, {});
    return has_time_left(dispatcher_.ready().timers(), limit) &&
           (has_run || dispatcher_.wait(worker, limit, &future));
  });
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return was_cancelled ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

}  // namespace takt
