// What an executor checks and makes before its workers run.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/executors/engine/spin_always.hpp"
#include "takt/sched/threads/memory_lock.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {
namespace {

std::vector<ThreadAttributes> threads_for(const ExecutorOptions& options,
                                          const ExecutorTraits& traits) {
  std::vector<ThreadAttributes> threads = options.threads;
  if (threads.empty()) {
    threads.resize(traits.pool ? std::max(2u, std::thread::hardware_concurrency()) : 1);
  }
  if (threads.size() > traits.max_threads) {
    throw Error(fmt::format("executor '{}' was given {} threads", options.name, threads.size()),
                fmt::format("this type takes at most {}", traits.max_threads));
  }
  return threads;
}

// The workers that no other thread of the pool is more urgent than.
std::vector<bool> most_urgent(std::span<const ThreadAttributes> threads) {
  std::vector<bool> result;
  for (const ThreadAttributes& thread : threads) {
    result.push_back(std::all_of(threads.begin(), threads.end(), [&](const auto& other) {
      return other.policy == thread.policy && other.priority <= thread.priority &&
             other.nice >= thread.nice;
    }));
  }
  return result;
}

// Whether its order depends on more than the callbacks that wait.
bool keeps_history(const std::string& scheduler) {
  const analysis::Order order = schedulers().traits(scheduler).order;
  return order == analysis::Order::arbitrary || order == analysis::Order::in_turns;
}

Nanoseconds unless_manual(Nanoseconds time, Clock* clock) {
  return clock->as_manual() != nullptr ? Nanoseconds::zero() : time;
}

}  // namespace

void check_spin(const ExecutorOptions& options, std::span<const ThreadAttributes> threads) {
  const auto check = [&](const char* option, Nanoseconds time) {
    if (time >= Nanoseconds::zero() && time <= kMostSpin) return;
    throw Error(fmt::format("executor '{}': {} is {} ns", options.name, option, time.count()),
                fmt::format("write 0 to {} ns", kMostSpin.count()));
  };
  check("early_wake", options.early_wake);
  if (options.spin == kSpinAlways) return check_spin_always(threads);
  check("spin", options.spin);
}

DispatchingExecutor::DispatchingExecutor(const ExecutorOptions& options,
                                         const ExecutorTraits& traits)
    : options_(options),
      traits_(traits),
      scheduler_(options.scheduler.empty() ? traits.scheduler : options.scheduler),
      threads_(threads_for(options, traits)),
      shared_(threads_.size() > 1),
      is_parallel_(shared_ && options.clock->as_manual() == nullptr),
      may_search_(is_parallel_ ? most_urgent(threads_) : std::vector<bool>(threads_.size())),
      records_times_(options.statistics == StatisticsLevel::full),
      times_take_(shared_ || options.trace_events != 0 || records_times_),
      spin_(unless_manual(options.spin, options.clock)),
      early_wake_(unless_manual(options.early_wake, options.clock)),
      trigger_(options_.trigger.own || options_.trigger.kind != TriggerOptions::Kind::any
                   ? std::make_unique<detail::Trigger>(options_.trigger)
                   : nullptr),
      let_(options_.trigger.let_period > Nanoseconds::zero()
               ? std::make_unique<Let>(options_.trigger)
               : nullptr),
      ready_(traits.readiness, *options.clock,
             records_times_ || options.trace_events != 0 || options.clock->as_manual() != nullptr ||
                 schedulers().traits(scheduler_).uses_time,
             keeps_history(scheduler_), options.watchdog.get(), trigger_.get()),
      spin_times_(threads_.size()),
      waits_(threads_.size(), kNever),
      has_changes_(true) {  // the first update brings the scheduler
  if (options.trace_events != 0) traces_.assign(threads_.size(), TraceRing(options.trace_events));
  if (!traits.triggered && (trigger_ != nullptr || let_ != nullptr)) {
    throw Error(fmt::format("executor '{}' is of a type that no trigger and no period governs",
                            options.name),
                "leave out `trigger` and `let`, or choose 'triggered'");
  }
  if (options.trigger.kind == TriggerOptions::Kind::one && options.trigger.one.empty()) {
    throw Error(
        fmt::format("executor '{}' is triggered by one callback without a name", options.name),
        "name it: node/callback");
  }
  if (options.trigger.let_period < Nanoseconds::zero()) {
    throw Error(fmt::format("executor '{}' has a period of {}", options.name,
                            to_string(options.trigger.let_period)),
                "give it time");
  }
  if (options.per != Isolation::node) {
    throw Error(fmt::format("executor '{}' is of a type that isolates nothing", options.name),
                "leave out `per`, or choose 'isolated'");
  }
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    ThreadAttributes& thread = threads_[i];
    if (thread.name.empty()) {
      thread.name = i == 0 ? options.name : fmt::format("{}-{}", options.name, i);
    }
    thread.check();
  }
  check_spin(options, threads_);
  if (options.wait != kAutoWait || options.clock->as_manual() != nullptr) {
    backend_ = make_wait_backend(options.wait, *options.clock, threads_.size(), false);
  }
  if (options.watchdog != nullptr) options.watchdog->add(watched_callbacks_);
}

void DispatchingExecutor::start_worker(std::size_t index) {
  thread_statistics_[index].asked = threads_[index];
  thread_statistics_[index].in_force = index == 0 && options_.threads.empty()
                                           ? this_thread_state()
                                           : apply(threads_[index], options_.realtime);
  if (is_realtime(thread_statistics_[index].in_force.policy)) prefault_stack();
}

}  // namespace takt
