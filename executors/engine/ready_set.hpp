// The ready callbacks of one executor, and how they become ready: readiness × scheduler.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_READY_SET_HPP_
#define TAKT_EXECUTORS_ENGINE_READY_SET_HPP_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/lockfree/inbox.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/engine/watchdog.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace TAKT_PUBLIC detail {

/// The effective parameters of a callback. They may change at a dispatch point.
struct CallbackSettings {
  CallbackInfo info;
  OverrunPolicy overrun = OverrunPolicy::catch_up;

  friend bool operator==(const CallbackSettings&, const CallbackSettings&) = default;
};

/// What the overrun handlers of a callback need; it outlives the record while they run. Names and
/// handlers never change.
struct Supervision {
  /// A deadline that the watchdog reports when it passes: one for the waiting release, one for each
  /// execution.
  struct Watch {
    /// Whether a miss has to be reported, here or by the watchdog, which then clears the deadline.
    /// Only the worker uses it.
    bool is_watched = false;
    std::atomic<TimePoint> deadline{kNever};
    std::atomic<std::uint64_t> chain_instance{0};  // the running one
  };
  explicit Supervision(std::size_t workers) : running(workers) {}

  /// The waiting release begins to run. Called under the dispatch lock, which a new release takes
  /// too.
  Watch& begin(std::size_t worker) noexcept {
    running[worker].is_watched = std::exchange(waiting.is_watched, false);
    running[worker].deadline.store(waiting.deadline.exchange(kNever));
    return running[worker];
  }

  std::string node, callback;
  OverrunHandler on_deadline_miss, on_overrun;
  Watch waiting;
  std::vector<Watch> running;  // one for each worker
};

/// What each dispatch of a callback writes: one cache line, as another worker may have had it last.
/// Serialised by the executor.
struct DispatchState : ReadyCallback {
  std::atomic<std::uint32_t> executing{0};  // written serialised; read by pending()
  // The scheduler, the next snapshot, a parking place or a worker has the record: one of them,
  // once. It is released when the last message was taken (exclusive groups: when its callback has
  // returned). Written serialised; read by pending(), and by the thread that waits to free a
  // removed record.
  std::atomic<bool> held{false};
  bool is_rearming = false;                  // a timer, while several are rearmed together
  bool drained = false;                      // `queued`, and out of the inbox: settling answers it
  std::atomic<bool> announced_again{false};  // by a worker's callback, while it was held
  std::uint64_t executions = 0;              // counted where there are statistics
};
static_assert(sizeof(DispatchState) == 64);

/// All that an executor keeps of one entity. A control thread creates it when the entity is added.
/// Fields without a comment never change, or are serialised by the executor.
struct CallbackRecord : DispatchState, Sink {
  std::shared_ptr<Entity> entity;
  std::shared_ptr<CallbackGroup> group;
  std::shared_ptr<Exclusion> exclusion;  // shared by the group
  CallbackSettings settings;
  CallbackInfo demoted_info;  // as settings.info, but less urgent than all others
  bool is_demoted = false;
  bool takes_briefly = false;  // as its entity says
  bool is_checked = false;  // after each execution; otherwise it has no deadline and is not demoted
  std::shared_ptr<Supervision> supervision;
  bool removed = false;
  std::atomic<std::uint32_t> gone{0};  // 1: removed and not executing; the remover sleeps on it
  std::atomic<bool> forgotten{false};  // removed, and in no list of the ready set but the inbox
  std::string node;
  // Where statistics are full; the second one of what takes messages.
  std::unique_ptr<CallbackTimes> times;
  std::unique_ptr<MessageTimes> message_times;

  // Dispatches write what follows, too: no publisher reads it.
  alignas(64) CallbackCounts counts;
  std::uint64_t discarded = 0;    // messages of aborted chain instances
  std::uint64_t lost_before = 0;  // what the entity had lost when last traced

  // Publishers read what follows: a cache line that the worker does not write each time.

  // Announced through the inbox, by any thread, and not yet answered.
  alignas(64) std::atomic<bool> queued{false};
  // A timer's record is in the inbox because its release time has changed.
  std::atomic<bool> changed{false};
  Arrival announced{};  // written by the thread that has set `queued`
  CallbackRecord* inbox_next = nullptr;

  void arrived(Arrival arrival) noexcept {
    sequence = arrival.sequence;
    ready_time = arrival.ready_time;
  }
  /// It is removed and does not execute. The caller's last access.
  [[gnu::cold, gnu::noinline]] void has_gone() noexcept;
  /// The last access to a removed record: the thread that waits to free it may do so.
  void let_go() noexcept {
    if (drained) queued.store(false);
    held.store(false, std::memory_order_release);  // pairs with the load before it is freed
  }
  CallbackId id() const noexcept { return settings.info.id; }
  bool is_described_by(const CallbackInfo* of) const noexcept {
    return of == &settings.info || of == &demoted_info;
  }
  /// The deadline of what became ready at that time.
  TimePoint deadline_of(TimePoint ready) const noexcept {
    const Nanoseconds relative = settings.info.deadline;
    return relative == Nanoseconds::zero() ? kNever : later(ready, relative);
  }
  bool is_timer() const noexcept { return settings.info.kind == EntityKind::timer; }
  bool is_reentrant() const noexcept { return exclusion->is_reentrant(); }

 protected:
  ~CallbackRecord() = default;
};

/// Whether this is the record's name: "node/callback", with or without the first slash of either.
bool is_called(const CallbackRecord& record, std::string_view name) noexcept;

/// Whether each execution has limits to keep, or is measured as part of a chain.
bool must_be_checked(const CallbackRecord& record, const CallbackSettings& settings) noexcept;

/// The condition on which ready callbacks may be served.
/// Thread safety: none; the executor calls it at dispatch points.
/// Real-time: nothing blocks or allocates, unless the user's function does.
class Trigger {
 public:
  explicit Trigger(const TriggerOptions& options) : options_(options) {}

  /// From here on it evaluates these callbacks; `room` has an input for each.
  void set(std::vector<CallbackRecord*>& callbacks, std::vector<TriggerInput>& room) noexcept;
  [[gnu::noinline]] bool fires() noexcept;

 private:
  const TriggerOptions& options_;
  std::vector<CallbackRecord*> callbacks_;
  std::vector<TriggerInput> inputs_;
  const CallbackRecord* one_ = nullptr;  // of Kind::one, while there is such a callback
};

/// Everything that depends on the set of callbacks. A control thread builds it, with all the memory
/// that will be needed. The executor installs it at a dispatch point, and leaves in it what it
/// replaces, which a control thread frees.
struct ScheduleUpdate {
  struct Parking {
    Exclusion* exclusion;
    std::unique_ptr<Scheduler> scheduler;
    ReadyCallback* parked = nullptr;  // during the exchange
  };
  struct Change {
    CallbackRecord* record;
    CallbackSettings settings;
  };
  std::unique_ptr<Scheduler> scheduler;  // nullptr, here and for groups: keep the present one
  std::vector<Parking> parking;
  std::vector<std::pair<TimePoint, CallbackRecord*>> timers;  // reserved for all timers
  std::vector<ReadyCallback*> next_snapshot;                  // room for all
  std::vector<CallbackRecord*> added, removed;
  std::vector<Change> changed;  // in order: the last one applies
  std::vector<CallbackRecord*> all;
  std::vector<TriggerInput> trigger_inputs;  // room for all
  bool reads_clock = false;                  // from now on
  std::shared_ptr<void> room;                // the executor's own
  ScheduleUpdate* inbox_next = nullptr;
};

/// Collects what becomes ready, and gives it out in the order of the scheduler.
/// Thread safety: announce, announce_change and has_announcements from any thread; all else is
/// serialised by the executor ("at a dispatch point").
/// Real-time: nothing blocks or allocates; O(log n) a callback for heap-ordered schedulers.
class ReadySet {
 public:
  /// `exact_time`: the clock is read at every dispatch, to look for due timers and to report to the
  /// scheduler how long callbacks ran. Otherwise, to save clock readings, it looks for due timers
  /// whenever nothing else is ready, and about every two microseconds: at every dispatch when
  /// callbacks are long, at every 64th when they are very short. `trigger`: the condition for
  /// serving a snapshot, or nullptr.
  ReadySet(Readiness readiness, Clock& clock, bool exact_time, Watchdog* watchdog, Trigger* trigger)
      : readiness_(readiness),
        windows_ahead_(readiness == Readiness::wait_set ? 0 : 1),
        clock_(clock),
        watchdog_(watchdog),
        trigger_(trigger),
        exact_time_(exact_time) {}

  /// Whether the clock is read at every dispatch. An update may turn it on.
  bool exact_time() const noexcept { return exact_time_.load(std::memory_order_relaxed); }

  /// An entity became ready. Returns true if a worker may have to be woken for it.
  bool announce(CallbackRecord& record, Arrival arrival) noexcept {
    // Most announcements of a busy callback end here. Sequentially consistent: see settle().
    if (record.queued.load() || record.queued.exchange(true)) return false;
    record.announced = arrival;
    inbox_.push(record);
    return true;
  }
  /// The same from a callback of a worker: no other thread can be here, so no atomic operation is
  /// needed.
  void announce_from_callback(CallbackRecord& record, Arrival arrival) noexcept {
    if (record.held.load(std::memory_order_relaxed)) {
      record.announced_again.store(true, std::memory_order_relaxed);
    } else if (!record.queued.load(std::memory_order_relaxed) && !record.removed) {
      record.held.store(true, std::memory_order_relaxed);
      enqueue(record, arrival);
    }  // otherwise it is in the inbox, and draining finds all its messages
  }
  /// A timer's release time has changed.
  bool announce_change(CallbackRecord& record) noexcept {
    if (record.changed.exchange(true)) return false;
    inbox_.push(record);
    return true;
  }
  bool has_announcements() const noexcept { return !inbox_.empty(); }

  /// Installs the update and leaves in it what it replaces.
  void install(ScheduleUpdate& update) noexcept;

  /// What `next` may do.
  struct Limits {
    std::uint64_t last_sequence = UINT64_MAX;  // events: run nothing that arrived later
    bool may_poll = true;                      // look for new announcements and due timers
  };
  /// The callback to run next, which then executes, or nullptr.
  CallbackRecord* next(const Limits& limits) noexcept;
  /// The same in two steps, for a caller that takes several before it executes them.
  CallbackRecord* pick(const Limits& limits) noexcept;
  void begin(CallbackRecord& record) noexcept;
  /// Whether another worker would find a callback to run now. What is ready in busy groups is
  /// parked, as that worker would do.
  [[gnu::noinline]] bool has_another() noexcept;
  /// Takes a snapshot, unless the last one is unfinished.
  [[gnu::noinline]] void take_snapshot() noexcept;
  /// Whether the snapshot may be served: it does not wait for a trigger.
  bool is_open() const noexcept { return is_open_.load(); }
  /// Looks for announcements and due timers: a polling point.
  void poll() noexcept;

  /// After take, in a reentrant group: what remains may run on another worker now.
  void taken(CallbackRecord& record, bool more) noexcept { settle(record, more); }
  /// After execute, if the time is exact. `as_picked`: as the record was when it was picked.
  void report_execution(const CallbackRecord& record, const ReadyCallback& as_picked,
                        Nanoseconds execution_time) noexcept {
    // A scheduler installed with the removal does not know the callback.
    if (!record.removed) scheduler_->done(as_picked, execution_time);
  }
  /// After that. `more`: as take has reported.
  void finished(CallbackRecord& record, bool more) noexcept;

  /// Gives back what `next` has put aside because of Limits::last_sequence.
  void restore_deferred() noexcept;

  /// Whether something is ready, besides what is in the inbox. It may have to wait for its group.
  bool has_waiting() const noexcept { return waiting_ != 0 || in_next_snapshot_ != 0; }
  std::size_t waiting() const noexcept { return waiting_; }
  bool is_wait_set() const noexcept { return readiness_ == Readiness::wait_set; }
  /// When the first timer is due; kNever when there is none.
  TimePoint next_release() const noexcept {
    return timers_.empty() || timers_stopped_.load() ? kNever : timers_.front().first;
  }
  /// When a timer may need another worker than the one that wakes up for the first: that one is due
  /// again, or one of another group is due. As far as it is known; kNever when it is not.
  TimePoint release_beside_first() const noexcept;
  void release_timers(bool released) noexcept { timers_stopped_.store(!released); }
  bool timers_are_held() const noexcept { return timers_stopped_.load(std::memory_order_relaxed); }

  /// The time as of the last reading, for callers that just read the clock (full statistics).
  void set_now(TimePoint now) noexcept { now_ = now; }
  TimePoint now() const noexcept { return now_; }
  void read_clock() noexcept { now_ = clock_.now(); }

 private:
  ReadyCallback* pop() noexcept {
    return alone_ != nullptr ? std::exchange(alone_, nullptr) : scheduler_->pop();
  }
  void enqueue(CallbackRecord& record, Arrival arrival) noexcept;
  void add_to_next_snapshot(ReadyCallback& callback) noexcept;
  [[gnu::noinline]] void push_next_snapshot() noexcept;
  void push(CallbackRecord& record) noexcept;
  [[gnu::noinline]] void push_checked(CallbackRecord& record) noexcept;
  static void set_urgency(CallbackRecord& record) noexcept;
  void set(CallbackRecord& record, const CallbackSettings& settings) noexcept;
  void hand_back(ReadyCallback* callback) noexcept;
  void settle(CallbackRecord& record, bool more) noexcept;
  [[gnu::noinline]] void drain_inbox() noexcept;
  [[gnu::noinline]] void release_due_timers() noexcept;
  void look_at_clock() noexcept;
  void arm(CallbackRecord& record) noexcept;
  void rearm(ReadyCallback* first) noexcept;
  void exchange_next_snapshot(ScheduleUpdate& update) noexcept;
  void exchange_timers(ScheduleUpdate& update) noexcept;

  const Readiness readiness_;
  // Without polling points, what arrives now belongs to the window after the one that is being
  // served: so under `ros` no callback overtakes for ever.
  const std::uint64_t windows_ahead_;
  Clock& clock_;
  Watchdog* const watchdog_;
  Trigger* const trigger_;
  std::atomic<bool> is_open_{true};  // the snapshot may be served; written serialised
  std::atomic<bool> exact_time_;     // written at a dispatch point
  std::atomic<bool> timers_stopped_{false};
  bool is_order_ = false;  // the scheduler
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::pair<TimePoint, CallbackRecord*>> timers_;  // a heap, the first due in front
  // Wait sets: what has become ready since the polling point. An array, as a list would write into
  // records that another worker has.
  std::vector<ReadyCallback*> next_snapshot_;

  // Each dispatch writes these: one cache line.
  alignas(64) ReadyCallback* alone_ = nullptr;  // the scheduler need not know it: no other waits
  std::size_t waiting_ = 0;                     // in the scheduler, or alone
  std::uint64_t window_ = 0;
  TimePoint now_{};
  std::uint32_t dispatches_until_look_ = 1, dispatches_between_looks_ = 1;  // for due timers
  ReadyCallback* deferred_ = nullptr;                                       // linked by next
  std::size_t in_next_snapshot_ = 0;

  alignas(64) Inbox<CallbackRecord> inbox_;  // any thread writes it
};

// ---- The hot path: inline, so that a worker's dispatch is one function ----

// Puts it back into the scheduler, with its old order of arrival.
inline void ReadySet::hand_back(ReadyCallback* callback) noexcept {
  if (callback == nullptr) [[likely]]  // no callback of the group is parked
    return;
  if (waiting_++ == 0 && is_order_) {
    alone_ = callback;
    return;
  }
  if (alone_ != nullptr) scheduler_->push(*std::exchange(alone_, nullptr));
  scheduler_->push(*callback);
}

inline void ReadySet::push(CallbackRecord& record) noexcept {
  record.window = window_ + windows_ahead_;
  if (record.is_checked) [[unlikely]]
    return push_checked(record);
  hand_back(&record);
}

inline void ReadySet::add_to_next_snapshot(ReadyCallback& callback) noexcept {
  next_snapshot_[in_next_snapshot_++] = &callback;
}

// A worker has found it ready. Its arrival is that of what it takes next.
inline void ReadySet::enqueue(CallbackRecord& record, Arrival arrival) noexcept {
  if (is_wait_set()) {
    if (has_announcements()) drain_inbox();  // they came before
    record.arrived(arrival);
    add_to_next_snapshot(record);
  } else {
    record.arrived(arrival);
    push(record);
  }
}

inline void ReadySet::poll() noexcept {
  if (has_announcements()) drain_inbox();
  if (is_wait_set()) {
    ++window_;
    if (in_next_snapshot_ != 0) push_next_snapshot();
  }
  if (!timers_.empty() && (exact_time() || waiting_ == 0 || --dispatches_until_look_ == 0)) {
    release_due_timers();
  }
}

inline CallbackRecord* ReadySet::pick(const Limits& limits) noexcept {
  if (trigger_ != nullptr) [[unlikely]] {
    if (limits.may_poll) take_snapshot();
    if (!is_open()) return nullptr;
  } else if (limits.may_poll && (!is_wait_set() || waiting_ == 0)) {
    poll();
  }
  ReadyCallback* first = pop();
  if (first == nullptr) return nullptr;
  --waiting_;
  auto& record = static_cast<CallbackRecord&>(*first);
  window_ = std::max(window_, record.window);
  record.announced_again.store(false, std::memory_order_relaxed);  // take sees what was sent so far
  return &record;
}

inline void ReadySet::begin(CallbackRecord& record) noexcept {
  // Relaxed: made visible by the swap that takes the message, see pending().
  record.executing.store(record.executing.load(std::memory_order_relaxed) + 1,
                         std::memory_order_relaxed);
}

inline CallbackRecord* ReadySet::next(const Limits& limits) noexcept {
  while (CallbackRecord* record = pick(limits)) {
    if (record->sequence > limits.last_sequence) {
      record->next = std::exchange(deferred_, record);
    } else if (record->exclusion->admit(*record)) {
      begin(*record);
      return record;
    }
  }
  return nullptr;
}

// The record has been served: it is released, or goes to the scheduler again if it has more. No
// announcement from another thread is lost: the publisher writes its message and then reads
// `queued`; this thread writes `queued` and then looks for messages. Both are sequentially
// consistent, so one of the two sees the other.
inline void ReadySet::settle(CallbackRecord& record, bool more) noexcept {
  if (record.removed) [[unlikely]]
    return record.let_go();
  if (record.is_timer()) {
    record.held.store(false, std::memory_order_relaxed);
    return arm(record);
  }
  if (!more && record.drained) {
    record.drained = false;
    record.queued.store(false);
    more = record.entity->ready_count() != 0;
  }
  if (!more && !record.announced_again.load(std::memory_order_relaxed)) {
    record.held.store(false, std::memory_order_relaxed);
    return;
  }
  Arrival arrival{};
  if (!record.entity->front(arrival)) arrival = {next_sequence(), now_};
  enqueue(record, arrival);
}

inline void ReadySet::finished(CallbackRecord& record, bool more) noexcept {
  const std::uint32_t executing = record.executing.load(std::memory_order_relaxed) - 1;
  const bool removed = record.removed;
  if (!record.is_reentrant()) [[likely]] {
    settle(record, more);
    hand_back(record.exclusion->leave());
  }
  // Release: pairs with the load in pending(); what the callback published is visible.
  record.executing.store(executing, std::memory_order_release);
  if (removed) [[unlikely]] {
    if (executing == 0) record.has_gone();
  }
}

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_READY_SET_HPP_
