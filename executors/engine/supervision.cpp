// What goes wrong in callbacks: exceptions; deadlines, budgets and overruns, at the end of an
// execution and by the watchdog.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <exception>
#include <mutex>

#include "takt/base/logger.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt {

// Gives the exception of a callback to the user's handler, or ends spin with it.
void DispatchingExecutor::caught(const CallbackRecord& record,
                                 std::exception_ptr exception) noexcept {
  if (handler_ && handler_({record.node, record.entity->name(), exception})) return;
  lock();
  if (exception_ == nullptr) exception_ = exception;
  unlock();
  wake_all();
}

// Called with the lock held. The watchdog may have looked while the deadline moved from the release
// to the execution, so it is expected again.
void DispatchingExecutor::watch_execution(CallbackRecord& record) noexcept {
  const detail::Supervision::Watch& watch = record.supervision->begin(place_);
  const TimePoint deadline = watch.deadline.load();
  if (options_.watchdog != nullptr && deadline != kNever) options_.watchdog->expect(deadline);
}

// Evaluates the end of an execution: its deadline and budget, the next release, and its chains.
// Calls the user's handlers without the lock.
void DispatchingExecutor::check_limits(CallbackRecord& record, const Slot& slot,
                                       const Dispatch& dispatch, TimePoint start,
                                       TimePoint end) noexcept {
  detail::Supervision& supervision = *record.supervision;
  detail::Supervision::Watch& watch = supervision.running[place_];
  watch.chain_instance.store(0);
  // The thread that clears the deadline reports the miss.
  const bool is_reported = watch.is_watched && watch.deadline.exchange(kNever) == kNever;
  lock();
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
  unlock();
  OverrunReport report{.node = supervision.node,
                       .callback = supervision.callback,
                       .sequence = slot.sequence,
                       .ready_time = slot.ready_time,
                       .deadline = deadline,
                       .end = end,
                       .execution_time = end - start,
                       .budget = budget};
  try {
    if (has_missed && !is_reported && supervision.on_deadline_miss)
      supervision.on_deadline_miss(report);
    if (has_overrun && supervision.on_overrun) supervision.on_overrun(report);
  } catch (...) {
    caught(record, std::current_exception());
  }
}

// Runs on the watchdog's thread. Finds one miss at a time, because handlers run without the mutex.
TimePoint DispatchingExecutor::report_misses(TimePoint now) noexcept {
  for (;;) {
    TimePoint next = kNever;
    std::shared_ptr<detail::Supervision> late;
    TimePoint missed = kNever;
    // Clears a deadline that has passed; returns true if it has a handler.
    const auto has_missed = [&](const Record& record, detail::Supervision::Watch& watch) {
      TimePoint deadline = watch.deadline.load();
      next = std::min(next, deadline > now ? deadline : kNever);
      // If this fails, the execution has just ended; if it has begun again, the watchdog expects
      // it.
      if (deadline > now || !watch.deadline.compare_exchange_strong(deadline, kNever)) return false;
      const std::uint64_t chain_instance = watch.chain_instance.load();
      if (chain_instance != 0 && record.wanted.overrun == OverrunPolicy::abort) {
        AbortedInstances::add(chain_instance);
      }
      missed = deadline;
      return record.supervision->on_deadline_miss != nullptr;
    };
    {
      const std::lock_guard lock(control_mutex_);
      for (const auto& entry : records_) {  // clang 14 captures no structured bindings
        const auto& record = entry.second;
        detail::Supervision& supervision = *record->supervision;
        if (has_missed(*record, supervision.waiting) ||
            std::any_of(supervision.running.begin(), supervision.running.end(),
                        [&](auto& watch) { return has_missed(*record, watch); })) {
          late = record->supervision;
          break;
        }
      }
    }
    if (late == nullptr) return next;
    try {
      late->on_deadline_miss({.node = late->node, .callback = late->callback, .deadline = missed});
    } catch (...) {
      log(LogLevel::error, "{}/{}: its handler of missed deadlines threw, on the watchdog's thread",
          late->node, late->callback);
    }
  }
}

}  // namespace takt
