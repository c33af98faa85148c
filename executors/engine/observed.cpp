// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/observed.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <sys/resource.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/entities/execution_watch.hpp"
#include "takt/executors/latency_slices.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt::detail {
namespace {

Entity::Counts counts_of(const Entity& entity, bool all_is_served) noexcept {
  Entity::Counts counts = entity.counts();
  if (all_is_served) {
    counts.expected -= std::min(counts.expected, std::uint64_t(entity.ready_count()));
  }
  return counts;
}

}  // namespace

Observed::Observed(std::shared_ptr<Entity> of, const Node& its_node,
                   const CallbackParameters& parameters, std::size_t workers, bool records_times)
    : entity(std::move(of)),
      group(entity->group()),
      supervision(std::make_shared<Supervision>(workers)),
      node(its_node.fully_qualified_name()) {
  supervision->node = node;
  supervision->callback = entity->name();
  supervision->on_deadline_miss = parameters.on_deadline_miss;
  supervision->on_overrun = parameters.on_overrun;
  if (!records_times) return;
  times = std::make_unique<SetAside<CallbackTimes>>();
  if (has_message_times(entity->kind())) {
    message_times = std::make_unique<SetAside<MessageTimes>>();
  }
}

void Observed::begin_counting() noexcept {
  counted_before = entity->answered();
  lost_before = counted_before.dropped + counted_before.missed;
}

void Observed::end_counting() noexcept {
  counted_in_the_end = counts_of(*entity, /*all_is_served=*/true);
  entity->set_answered(counted_in_the_end);
}

// ---- Times and traces ----

// The classes late and too late are those of irobot-ros/ros2-performance: of the message's period
// T, late is more than min(20 % T, 5 ms), too late more than min(T, 50 ms).
void Observed::record_times(const Slot& slot, const ExecutionTimes& at,
                            LatencySlices* slices) noexcept {
  CallbackTimes& all = times->get();
  all.execution.record(at.end - at.start);
  if (at.allocations != 0) counts.allocations += at.allocations;
  if (slot.ready_time == TimePoint{}) return;  // sent before any reader needed its time
  const Nanoseconds latency = at.start - slot.ready_time;
  all.latency.record(latency);
  if (message_times != nullptr) {
    MessageTimes& parts = message_times->get();
    parts.waiting.record(at.picked - slot.ready_time);
    parts.take.record(at.start - at.picked);
    if (slices != nullptr) slices->record(at.start, latency);
  }
  const Nanoseconds period = slot.expected_period;
  if (period == Nanoseconds::zero() || is_timer()) return;
  ++counts.with_period;
  if (latency > std::min<Nanoseconds>(period, std::chrono::milliseconds(50))) {
    ++counts.too_late;
  } else if (latency > std::min<Nanoseconds>(period / 5, std::chrono::milliseconds(5))) {
    ++counts.late;
  }
}

ThreadUsage ThreadUsage::now() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {thread_cpu_time(), usage.ru_nvcsw};
}

void Observed::trace(TraceRing& ring, const Slot& slot, const ExecutionTimes& at) noexcept {
  const std::uint64_t lost = entity->lost();
  ring.record({.callback = id(),
               .sequence = slot.sequence,
               .chain_instance = slot.chain_instance == 0
                                     ? slot.sequence
                                     : instance_before_joins(slot.chain_instance),
               .path = extend_path(slot.path, entity->mark()),
               .lost = lost - lost_before.exchange(lost),
               .ready = slot.ready_time == TimePoint{} ? at.picked : slot.ready_time,
               .picked = at.picked,
               .start = at.start,
               .end = at.end,
               .cpu_time = at.used.cpu_time,
               .has_waited = at.used.waits != 0});
}

// ---- Limits ----

bool Observed::must_be_checked(const CallbackSettings& with) const noexcept {
  return with.info.deadline != Nanoseconds::zero() || with.info.budget != Nanoseconds::zero() ||
         with.overrun != OverrunPolicy::catch_up || with.serving == Serving::dropped ||
         supervision->on_overrun || !entity->chain_steps().empty() ||
         entity->execution_watch() != nullptr;
}

// The watchdog may have looked, and found nothing, while the deadline moved from the release to the
// execution: so it is notified again.
bool Observed::watch_execution(std::size_t worker, Watchdog* watchdog) noexcept {
  const TimePoint deadline = supervision->begin(worker).deadline.load();
  if (watchdog != nullptr && deadline != kNever) watchdog->expect(deadline);
  return is_dropped();
}

void Observed::begin_checked(std::size_t worker, const Dispatch& dispatch) noexcept {
  Supervision::Watch& watch = supervision->running[worker];
  watch.chain_instance.store(dispatch.chain_instance);
  if (entity->execution_watch() != nullptr) watch.used_before = thread_cpu_time();
}

void Observed::check_limits(DispatchLock& lock, std::size_t worker, const Slot& slot,
                            const Dispatch& dispatch, const ExecutionTimes& at) {
  const TimePoint start = at.start, end = at.end;
  Supervision::Watch& watch = supervision->running[worker];
  ExecutionWatch* const assumed = entity->execution_watch().get();
  const Nanoseconds used = assumed != nullptr && assumed->may_be_too_long(end - start)
                               ? thread_cpu_time() - watch.used_before
                               : Nanoseconds::zero();
  watch.chain_instance.store(0);
  // The thread that clears the deadline reports the miss.
  const bool is_reported = watch.is_watched && watch.deadline.exchange(kNever) == kNever;
  lock.lock();
  const Nanoseconds budget = settings.info.budget;
  const TimePoint deadline = deadline_of(slot.ready_time);
  const bool has_missed = end > deadline;
  const bool is_over_budget = budget != Nanoseconds::zero() && end - start > budget;
  const bool has_overrun = is_over_budget || (is_timer() && entity->next_release() < end);
  if (assumed != nullptr) assumed->check(slot.ready_time, end, used);
  if (has_missed) ++counts.deadline_misses;
  if (is_over_budget) ++counts.overruns;
  const bool is_bad = has_missed || has_overrun;
  const OverrunPolicy policy = settings.overrun;
  is_demoted = is_bad && policy == OverrunPolicy::demote;
  if (is_bad && policy == OverrunPolicy::skip) entity->skip_releases(end);
  const bool is_aborted = is_bad && policy == OverrunPolicy::abort;
  if (is_aborted) AbortedInstances::add(dispatch.chain_instance);
  for (const ChainStep& step : entity->chain_steps()) {
    const std::optional<TimePoint> root = root_release(dispatch, step.path);
    if (!root) continue;  // it came on another path
    if (step.is_last) {
      step.chain->finished(end - *root, is_joined(dispatch.chain_instance));
    } else if (is_aborted) {
      step.chain->aborted();
    }
  }
  lock.unlock();
  OverrunReport report{.node = supervision->node,
                       .callback = supervision->callback,
                       .sequence = slot.sequence,
                       .ready_time = slot.ready_time,
                       .deadline = deadline,
                       .end = end,
                       .execution_time = end - start,
                       .budget = budget};
  if (has_missed && !is_reported && supervision->on_deadline_miss)
    supervision->on_deadline_miss(report);
  if (has_overrun && supervision->on_overrun) supervision->on_overrun(report);
}

bool Supervision::find_miss(const std::shared_ptr<Supervision>& supervision, OverrunPolicy overrun,
                            TimePoint now, Miss& miss) noexcept {
  const auto has_missed = [&](Watch& watch) {
    TimePoint deadline = watch.deadline.load();
    miss.next = std::min(miss.next, deadline > now ? deadline : kNever);
    // If this fails, the execution has just ended; a next one has notified the watchdog again.
    if (deadline > now || !watch.deadline.compare_exchange_strong(deadline, kNever)) return false;
    const std::uint64_t chain_instance = watch.chain_instance.load();
    if (chain_instance != 0 && overrun == OverrunPolicy::abort) {
      AbortedInstances::add(chain_instance);
    }
    miss.missed = deadline;
    return supervision->on_deadline_miss != nullptr;
  };
  if (!has_missed(supervision->waiting) &&
      std::none_of(supervision->running.begin(), supervision->running.end(), has_missed)) {
    return false;
  }
  miss.late = supervision;
  return true;
}

void Supervision::report(const Miss& miss) noexcept {
  const Supervision& late = *miss.late;
  try {
    late.on_deadline_miss({.node = late.node, .callback = late.callback, .deadline = miss.missed});
  } catch (...) {
    log(LogLevel::error, "{}/{}: on_deadline_miss threw, on the thread `watchdog`", late.node,
        late.callback);
  }
}

// ---- Statistics ----

Entity::Counts Observed::entity_counts(bool has_ended, bool all_is_served) const noexcept {
  Entity::Counts since = has_ended ? counted_in_the_end : counts_of(*entity, all_is_served);
  const auto subtract = [](std::uint64_t& from, std::uint64_t before) noexcept {
    from -= std::min(from, before);  // a node that is not active may expect fewer by now
  };
  subtract(since.expected, counted_before.expected);
  subtract(since.from_outside, counted_before.from_outside);
  subtract(since.dropped, counted_before.dropped);
  subtract(since.missed, counted_before.missed);
  return since;
}

CallbackStatistics Observed::statistics(const Entity::Counts& counted) const {
  CallbackStatistics statistics;
  statistics.received = counts.executions;
  if (counts.with_period != 0) {
    statistics.late = counts.late;
    statistics.too_late = counts.too_late;
  }
  statistics.deadline_misses = counts.deadline_misses;
  statistics.overruns = counts.overruns;
  if (times != nullptr && allocations_are_counted()) statistics.allocations = counts.allocations;
  if (const auto* made = times != nullptr ? times->made() : nullptr) {
    static_cast<CallbackTimes&>(statistics) = *made;
  }
  if (const auto* made = message_times != nullptr ? message_times->made() : nullptr) {
    static_cast<MessageTimes&>(statistics) = *made;
  }
  statistics.node = node;
  statistics.group = group->name();
  statistics.callback = entity->name();
  statistics.kind = entity->kind();
  statistics.topic = entity->topic();
  statistics.dropped = counted.dropped + counts.discarded;
  statistics.dropped_by_mode = dropped_by_mode;
  statistics.skipped = counted.missed;
  statistics.overruns += counted.missed;
  statistics.from_outside = counted.from_outside;
  const bool is_timer = entity->kind() == EntityKind::timer;
  statistics.expected =
      is_timer ? statistics.received + statistics.dropped_by_mode : counted.expected;
  return statistics;
}

// The releases of a timer that were due when timers were held, and that nobody has taken. A timer
// that starves has no execution that would count them.
std::uint64_t releases_left(const Entity& timer, TimePoint held) noexcept {
  const TimePoint due = timer.next_release().value_or(kNever);
  return due > held ? 0 : static_cast<std::uint64_t>((held - due) / timer.period()) + 1;
}

void check_begin_trace(const ExecutorOptions& options) {
  if (options.trace_events != 0) {
    throw Error(fmt::format("executor '{}' is traced for all of its time", options.name),
                "end that run: it writes its trace then");
  }
  if (options.statistics != StatisticsLevel::full) {
    throw Error(fmt::format("executor '{}' reads no times, so it cannot be traced", options.name),
                "make it with statistics `full`");
  }
}

NamedTraceEvent named(const TraceEvent& event, const Traced* of) {
  if (of == nullptr) return {event, "(removed)"};
  return {event, of->name, of->kind, retract_path(event.path, of->mark)};
}

}  // namespace takt::detail
