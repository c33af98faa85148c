// The callbacks of one executor that are ready, and how they come to be: readiness × scheduler.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_READY_SET_HPP_
#define TAKT_EXECUTORS_READY_SET_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/inbox.hpp"
#include "takt/base/sequence.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt {

/// When announced callbacks reach the scheduler.
enum class Readiness {
  wait_set,  // all at once, at a polling point: when the last snapshot has been handed out
  events,    // at every dispatch
};

/// All that an executor keeps of one entity, made by a control thread when the entity is added.
/// Fields without a comment never change, or are serialised by the executor.
struct CallbackRecord : ReadyCallback, Sink {
  std::shared_ptr<Entity> entity;
  std::shared_ptr<CallbackGroup> group;
  std::string node;
  CallbackInfo description;
  CallbackStatistics statistics;
  bool removed = false;
  std::atomic<std::uint32_t> executing{0};  // written serialised; read by pending()

  // From the announcement until the last message was taken (exclusive groups: until its callback
  // returned) the record is in the inbox, in the scheduler, parked or executing: once, in all.
  std::atomic<bool> queued{false};
  // A timer's record stands in the inbox because its release time has changed.
  std::atomic<bool> changed{false};
  std::atomic<std::uint32_t> gone{0};  // 1: removed and not executing; the remover sleeps on it
  CallbackRecord* inbox_next = nullptr;

  void arrived(const Arrival& arrival) noexcept {
    sequence = arrival.sequence;
    ready_time = arrival.ready_time;
  }
  bool is_timer() const noexcept { return description.kind == EntityKind::timer; }
  bool is_reentrant() const noexcept { return group->type() == CallbackGroupType::Reentrant; }

 protected:
  ~CallbackRecord() = default;
};

/// Everything that depends on which callbacks there are. A control thread builds it, with all the
/// memory that will be needed; the executor takes it over at a dispatch point, and what it
/// replaces goes back in the same object to be freed by a control thread.
struct ReadyPlan {
  std::unique_ptr<Scheduler> scheduler;
  std::vector<std::pair<CallbackGroup*, std::unique_ptr<Scheduler>>> parking;
  std::vector<std::pair<TimePoint, CallbackRecord*>> timers;  // reserved for all timers
  std::vector<CallbackRecord*> added, removed;
  ReadyPlan* inbox_next = nullptr;
};

/// Thread safety: announce, announce_change and has_news from any thread; all else is serialised
/// by the executor ("at a dispatch point").
/// Real-time: nothing blocks or allocates; O(log n) a callback for heap-ordered schedulers.
class ReadySet {
 public:
  /// `exact_time`: the clock is read at every dispatch, to look for due timers and to tell the
  /// scheduler how long callbacks ran. Otherwise timers are looked for, to spare clock readings, at
  /// every sixteenth and whenever nothing else is ready.
  ReadySet(Readiness readiness, Clock& clock, bool exact_time)
      : readiness_(readiness), clock_(clock), exact_time_(exact_time) {}

  /// An entity became ready. True when somebody may have to be woken for it.
  bool announce(CallbackRecord& record, const Arrival& arrival) noexcept {
    // Most announcements of a busy callback end here. Sequentially consistent: see settle().
    if (record.queued.load() || record.queued.exchange(true)) return false;
    record.arrived(arrival);
    inbox_.push(record);
    return true;
  }
  /// The same on the thread of the only worker, from a callback: events go straight to the
  /// scheduler, without the inbox. Nobody has to be woken.
  void announce_from_callback(CallbackRecord& record, const Arrival& arrival) noexcept {
    if (record.queued.load() || record.queued.exchange(true)) return;
    record.arrived(arrival);
    if (is_wait_set()) {
      inbox_.push(record);
    } else {
      push(record);
    }
  }
  /// A timer's release time has changed.
  bool announce_change(CallbackRecord& record) noexcept {
    if (record.changed.exchange(true)) return false;
    inbox_.push(record);
    return true;
  }
  bool has_news() const noexcept { return !inbox_.empty(); }

  /// Takes the plan over and leaves in it what it replaces.
  void install(ReadyPlan& plan) noexcept;

  /// What `next` may do.
  struct Limits {
    std::uint64_t last_sequence = UINT64_MAX;  // events: run nothing that arrived later
    bool may_poll = true;                      // look for new announcements and due timers
  };
  /// The callback to run next, which then executes, or nullptr.
  CallbackRecord* next(const Limits& limits) noexcept;
  /// Looks for announcements and due timers: a polling point.
  void poll() noexcept;

  /// After take, in a reentrant group: what remains may run on another worker now.
  void taken(CallbackRecord& record, bool more) noexcept { settle(record, more); }
  /// After execute; `callback` is how the record was when it was picked, `more` what take said.
  void finished(CallbackRecord& record, const ReadyCallback& callback, bool more,
                Nanoseconds execution_time) noexcept;

  /// Gives back what `next` has put aside because of Limits::last_sequence.
  void restore_deferred() noexcept;

  std::size_t waiting() const noexcept { return waiting_; }
  bool is_wait_set() const noexcept { return readiness_ == Readiness::wait_set; }
  /// When the first timer is due; kNever when there is none.
  TimePoint next_release() const noexcept {
    return timers_.empty() || timers_stopped_.load() ? kNever : timers_.front().first;
  }
  void stop_timers() noexcept { timers_stopped_.store(true); }

  /// The time as of the last reading, for those who just read the clock (full statistics).
  void set_now(TimePoint now) noexcept { now_ = now; }
  TimePoint now() const noexcept { return now_; }
  void read_clock() noexcept { now_ = clock_.now(); }

 private:
  void push(CallbackRecord& record) noexcept;
  void hand_back(ReadyCallback* callback) noexcept;
  void settle(CallbackRecord& record, bool more) noexcept;
  void drain_inbox() noexcept;
  void release_due_timers() noexcept;
  void arm(CallbackRecord& record) noexcept;
  void disarm(CallbackRecord& record) noexcept;

  const Readiness readiness_;
  Clock& clock_;
  const bool exact_time_;
  Inbox<CallbackRecord> inbox_;
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::pair<TimePoint, CallbackRecord*>> timers_;  // a heap, the first due in front
  CallbackRecord* deferred_ = nullptr;                         // linked by inbox_next
  std::size_t waiting_ = 0;                                    // in the scheduler
  std::uint64_t window_ = 0;
  std::uint32_t dispatches_ = 0;
  TimePoint now_{};
  std::atomic<bool> timers_stopped_{false};
};

// ---- The hot path: inline, so that a worker's dispatch is one function ----

// Back into the scheduler with its old order of arrival.
inline void ReadySet::hand_back(ReadyCallback* callback) noexcept {
  if (callback == nullptr) return;
  scheduler_->push(*callback);
  ++waiting_;
}

inline void ReadySet::push(CallbackRecord& record) noexcept {
  // Where there are no polling points, what arrives now belongs to the window after the one that
  // is being handed out: so under `ros` nobody overtakes for ever.
  record.window = is_wait_set() ? window_ : window_ + 1;
  const Nanoseconds deadline = record.description.deadline;
  record.ReadyCallback::deadline =
      deadline == Nanoseconds::zero() ? kNever : record.ready_time + deadline;
  hand_back(&record);
}

inline void ReadySet::poll() noexcept {
  if (is_wait_set()) ++window_;
  if (has_news()) drain_inbox();
  if (!timers_.empty() && (exact_time_ || waiting_ == 0 || ++dispatches_ % 16 == 0)) {
    release_due_timers();
  }
}

inline CallbackRecord* ReadySet::next(const Limits& limits) noexcept {
  for (;;) {
    if (limits.may_poll && (!is_wait_set() || waiting_ == 0)) poll();
    ReadyCallback* first = scheduler_->pop();
    if (first == nullptr) return nullptr;
    --waiting_;
    auto& record = static_cast<CallbackRecord&>(*first);
    if (record.window > window_) window_ = record.window;
    if (record.removed) {
      hand_back(record.group->unpark());
      record.queued.store(false);  // our last touch of it
    } else if (record.sequence > limits.last_sequence) {
      record.inbox_next = std::exchange(deferred_, &record);
    } else if (record.group->admit(record)) {
      // Relaxed: made visible by the swap that takes the message, see pending().
      record.executing.store(record.executing.load(std::memory_order_relaxed) + 1,
                             std::memory_order_relaxed);
      return &record;
    }
  }
}

// The record is at nobody's now: queue it again if more is there, else let it be announced. Both
// sides are sequentially consistent: the publisher writes its message and then reads `queued`, we
// write `queued` and then look for messages, so one of the two sees the other.
inline void ReadySet::settle(CallbackRecord& record, bool more) noexcept {
  if (record.removed) {
    record.queued.store(false);
    return;
  }
  if (record.is_timer()) {
    record.queued.store(false);
    disarm(record);  // it may have been armed by a reset meanwhile
    arm(record);
    return;
  }
  if (!more) {
    record.queued.store(false);
    if (record.entity->ready_count() == 0 || record.queued.exchange(true)) return;
  }
  Arrival arrival{next_sequence(), now_};
  record.entity->front(arrival);
  record.arrived(arrival);
  if (is_wait_set()) {
    inbox_.push(record);  // for the next snapshot
  } else {
    push(record);
  }
}

inline void ReadySet::finished(CallbackRecord& record, const ReadyCallback& callback, bool more,
                               Nanoseconds execution_time) noexcept {
  if (exact_time_) scheduler_->done(callback, execution_time);
  const std::uint32_t executing = record.executing.load(std::memory_order_relaxed) - 1;
  const bool is_gone = record.removed && executing == 0;
  if (!record.is_reentrant()) settle(record, more);
  hand_back(record.group->leave());
  // Release: pairs with the load in pending(); what the callback published is visible.
  record.executing.store(executing, std::memory_order_release);
  if (is_gone) {
    record.gone.store(1);
    record.gone.notify_all();
  }
}

}  // namespace takt

#endif  // TAKT_EXECUTORS_READY_SET_HPP_
