// What an executor counts, measures, traces and checks of one callback.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_OBSERVED_HPP_
#define TAKT_EXECUTORS_ENGINE_OBSERVED_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/counter.hpp"
#include "takt/base/set_aside.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/engine/dispatch_lock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/watchdog.hpp"

namespace takt::detail {

/// The effective parameters of a callback. They may change at a dispatch point.
struct CallbackSettings {
  CallbackInfo info;
  OverrunPolicy overrun = OverrunPolicy::catch_up;
  Serving serving = Serving::usual;
  std::uint32_t releases = 1;        // of a timer: how many may wait
  std::uint64_t label = 0;           // the one that the executor's rule gave it
  WorkerSet workers = ~WorkerSet{};  // that may take it

  /// What schedulers see, unless an overrun has demoted it.
  CallbackInfo seen() const noexcept { return serving == Serving::usual ? info : demoted(info); }
  friend bool operator==(const CallbackSettings&, const CallbackSettings&) = default;
};

/// The resources that a thread has used so far, or for one execution.
struct ThreadUsage {
  Nanoseconds cpu_time{0};
  std::int64_t waits = 0;  // voluntary context switches: a lock, a sleep; not preemption
  ThreadUsage operator-(const ThreadUsage& before) const noexcept {
    return {cpu_time - before.cpu_time, waits - before.waits};
  }
  /// The usage of the calling thread. Read outside the measured time of a traced execution, because
  /// reading takes longer than many a callback.
  [[gnu::cold, gnu::noinline]] static ThreadUsage now() noexcept;
};

/// Of one execution.
struct ExecutionTimes {
  TimePoint picked, start, end;
  bool are_read = false;   // false: all three are the time of the pick
  bool is_traced = false;  // its thread was recording a trace when it began
  ThreadUsage used = {};
  std::uint64_t allocations = 0;
};

/// What the overrun handlers of a callback need. Shared, because a running handler may outlive the
/// callback. Names and handlers never change.
struct Supervision {
  /// A deadline that the watchdog reports when it passes: one for the waiting release, one for each
  /// execution.
  struct Watch {
    /// Whether the watchdog watches the deadline, too: the thread that clears it reports the miss.
    /// Only the worker uses this flag.
    bool is_watched = false;
    std::atomic<TimePoint> deadline{kNever};
    std::atomic<std::uint64_t> chain_instance{0};  // of the running execution
    Nanoseconds used_before{0};  // CPU time of the thread at the start, if it is watched
  };
  explicit Supervision(std::size_t workers) : running(workers) {}

  /// The waiting release begins to run. Called under the dispatch lock, which a new release takes
  /// too.
  Watch& begin(std::size_t worker) noexcept {
    running[worker].is_watched = std::exchange(waiting.is_watched, false);
    running[worker].deadline.store(waiting.deadline.exchange(kNever));
    return running[worker];
  }
  /// A release has become ready, and waits to be picked. Under the dispatch lock, too.
  void wait(TimePoint until, Watchdog& watchdog) noexcept {
    waiting.is_watched = true;
    waiting.deadline.store(until);
    watchdog.expect(until);
  }

  /// The waiting release is dropped, and its miss not reported. Under the dispatch lock, too.
  void forget_waiting() noexcept {
    waiting.is_watched = false;
    waiting.deadline.store(kNever);
  }

  /// A deadline that has passed, and when the next one does.
  struct Miss {
    std::shared_ptr<Supervision> late;  // nullptr: there is none
    TimePoint missed = kNever, next = kNever;
  };
  /// Clears a deadline that has passed. Returns true if there is a handler to call.
  static bool find_miss(const std::shared_ptr<Supervision>& supervision, OverrunPolicy overrun,
                        TimePoint now, Miss& miss) noexcept;
  /// On the watchdog's thread, without a lock.
  static void report(const Miss& miss) noexcept;

  std::string node, callback;
  OverrunHandler on_deadline_miss, on_overrun;
  Watch waiting;
  std::vector<Watch> running;  // one for each worker
};

/// The counters of a callback that each dispatch may write.
struct DispatchCounts {
  Counter<> executions;
  Counter<> with_period, late, too_late, deadline_misses, overruns;
  Counter<> discarded;  // messages of aborted chain instances
  Counter<> allocations;
};

/// Fields without a comment never change, or are serialised by the executor; so are methods, unless
/// they say otherwise.
/// Real-time: methods that allocate say so, and those off the hot path are marked cold.
struct Observed {
  /// `workers`: how many the executor has. Allocates.
  Observed(std::shared_ptr<Entity> of, const Node& its_node, const CallbackParameters& parameters,
           std::size_t workers, bool records_times);

  std::shared_ptr<Entity> entity;
  std::shared_ptr<CallbackGroup> group;
  CallbackSettings settings;
  bool is_demoted = false;
  bool is_checked = false;  // it has limits, checked after each execution; else it is never demoted
  std::shared_ptr<Supervision> supervision;
  std::string node;
  // At statistics `full`; the second one if it takes messages. Control threads copy them.
  std::unique_ptr<SetAside<CallbackTimes>> times;
  std::unique_ptr<SetAside<MessageTimes>> message_times;

  // The entity's counts when its last executor before this one gave it back, and when this one did.
  Entity::Counts counted_before, counted_in_the_end;
  Counter<> dropped_by_mode;  // not with the others, which fill a cache line

  // Dispatches write the fields below, too: no publisher reads them.
  alignas(64) DispatchCounts counts;
  std::atomic<std::uint64_t> lost_before{0};  // the entity's lost count at its last trace event

  CallbackId id() const noexcept { return settings.info.id; }
  bool is_dropped() const noexcept { return settings.serving == Serving::dropped; }
  bool is_timer() const noexcept { return settings.info.kind == EntityKind::timer; }
  /// The deadline of a message or release that became ready at that time.
  TimePoint deadline_of(TimePoint ready) const noexcept {
    const Nanoseconds relative = settings.info.deadline;
    return relative == Nanoseconds::zero() ? kNever : later(ready, relative);
  }
  /// Whether each execution has limits to keep, or is measured as part of a chain.
  bool must_be_checked(const CallbackSettings& with) const noexcept;
  /// This executor has the entity from now on: what it counted before is subtracted.
  void begin_counting() noexcept;
  /// The entity has left this executor: its counts are final.
  void end_counting() noexcept;
  /// The first traced execution does not count what the entity lost before it.
  void begin_trace() noexcept { lost_before.store(entity->lost()); }

  /// The context in which the callback runs with the input that was taken.
  Dispatch dispatch(const Slot& slot, const CallbackInfo* info, StagedOutputs* outputs,
                    const Exclusion* exclusion) const noexcept {
    const bool is_root = slot.chain_instance == 0;
    return {info,
            is_root ? slot.sequence : slot.chain_instance,
            is_root ? slot.ready_time : slot.root_release,
            extend_path(slot.path, entity->mark()),
            outputs,
            exclusion};
  }
  /// With the lock held: the callback was picked, and has limits to keep. Returns true if its input
  /// must be dropped.
  [[gnu::cold, gnu::noinline]] bool watch_execution(std::size_t worker,
                                                    Watchdog* watchdog) noexcept;
  /// Without the lock: the callback begins.
  [[gnu::cold, gnu::noinline]] void begin_checked(std::size_t worker,
                                                  const Dispatch& dispatch) noexcept;
  /// Without the lock: evaluates the end of an execution by its deadline and budget, the next
  /// release, and its chains. Throws what the user's handlers throw.
  [[gnu::cold, gnu::noinline]] void check_limits(DispatchLock& lock, std::size_t worker,
                                                 const Slot& slot, const Dispatch& dispatch,
                                                 const ExecutionTimes& times);
  void record_times(const Slot& slot, const ExecutionTimes& times, LatencySlices* slices) noexcept;
  [[gnu::cold, gnu::noinline]] void trace(TraceRing& ring, const Slot& slot,
                                          const ExecutionTimes& times) noexcept;

  /// The entity's counts since this executor got it. `all_is_served`: messages that still wait are
  /// not expected.
  Entity::Counts entity_counts(bool has_ended, bool all_is_served) const noexcept;
  /// On a control thread: a worker may be changing the settings, so they are not read. Allocates.
  CallbackStatistics statistics(const Entity::Counts& counted) const;
};

/// The releases of a timer that were due when timers were held, and that nobody has taken. A timer
/// that starves has no execution that would count them.
std::uint64_t releases_left(const Entity& timer, TimePoint held) noexcept;

// Limit: removed callbacks that an executor names in its trace. At it: the others are "(removed)".
// Seen: in the trace.
inline constexpr std::size_t kMostTraced = 10'000;

/// Throws Error if the executor with these options cannot begin a trace while it runs.
void check_begin_trace(const ExecutorOptions& options);

/// What a trace says of a callback.
struct Traced {
  explicit Traced(const Observed& callback)
      : name(callback.node + "/" + callback.entity->name()),
        kind(callback.entity->kind()),
        mark(callback.entity->mark()) {}
  std::string name;
  EntityKind kind;
  std::uint64_t mark;
};
/// `of`: nullptr if it is not known.
NamedTraceEvent named(const TraceEvent& event, const Traced* of);

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_OBSERVED_HPP_
