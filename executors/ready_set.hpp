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

  // The scheduler, a parking place or a worker has the record: once, in all. It is given back when
  // the last message was taken (exclusive groups: when its callback has returned). Written
  // serialised; read by pending(), and by who waits to free a removed record.
  std::atomic<bool> held{false};
  // Announced through the inbox, by any thread, and not yet answered.
  std::atomic<bool> queued{false};
  Arrival announced{};           // by whom: written by the thread that has set `queued`
  bool drained = false;          // `queued`, and out of the inbox: settling answers it
  bool announced_again = false;  // from a callback of the only worker, while it was held
  // A timer's record stands in the inbox because its release time has changed.
  std::atomic<bool> changed{false};
  std::atomic<std::uint32_t> gone{0};  // 1: removed and not executing; the remover sleeps on it
  CallbackRecord* inbox_next = nullptr;

  void arrived(const Arrival& arrival) noexcept {
    sequence = arrival.sequence;
    ready_time = arrival.ready_time;
  }
  /// The last touch of a removed record: whoever waits to free it may do so.
  void let_go() noexcept {
    if (drained) queued.store(false);
    held.store(false, std::memory_order_release);  // pairs with the load of who frees it
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
    record.announced = arrival;
    inbox_.push(record);
    return true;
  }
  /// The same from a callback, on the thread of the only worker: nobody has to be woken. No other
  /// thread can be at the scheduler, so an event goes there without any atomic operation.
  void announce_from_callback(CallbackRecord& record, const Arrival& arrival) noexcept {
    if (is_wait_set()) {
      announce(record, arrival);
    } else if (record.held.load(std::memory_order_relaxed)) {
      record.announced_again = true;
    } else if (!record.queued.load(std::memory_order_relaxed)) {
      record.arrived(arrival);
      hold(record);
    }  // else it is in the inbox, and what is taken out of there looks at all messages
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
  void release_timers(bool released) noexcept { timers_stopped_.store(!released); }

  /// The time as of the last reading, for those who just read the clock (full statistics).
  void set_now(TimePoint now) noexcept { now_ = now; }
  TimePoint now() const noexcept { return now_; }
  void read_clock() noexcept { now_ = clock_.now(); }

 private:
  void hold(CallbackRecord& record) noexcept;
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
  ReadyCallback* deferred_ = nullptr;                          // linked by next
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

inline void ReadySet::hold(CallbackRecord& record) noexcept {
  record.held.store(true, std::memory_order_relaxed);
  push(record);
}

inline CallbackRecord* ReadySet::next(const Limits& limits) noexcept {
  for (;;) {
    if (limits.may_poll && (!is_wait_set() || waiting_ == 0)) poll();
    ReadyCallback* first = scheduler_->pop();
    if (first == nullptr) return nullptr;
    --waiting_;
    auto& record = static_cast<CallbackRecord&>(*first);
    if (record.window > window_) window_ = record.window;
    if (record.sequence > limits.last_sequence) {
      record.next = std::exchange(deferred_, &record);
    } else if (record.group->admit(record)) {
      record.announced_again = false;  // what was sent so far, take sees
      // Relaxed: made visible by the swap that takes the message, see pending().
      record.executing.store(record.executing.load(std::memory_order_relaxed) + 1,
                             std::memory_order_relaxed);
      return &record;
    }
  }
}

// The record has been served: it is given back, or goes to the scheduler again if more is there.
// Announcements from other threads are answered so that none is lost: the publisher writes its
// message and then reads `queued`, we write `queued` and then look for messages, both sequentially
// consistent, so one of the two sees the other.
inline void ReadySet::settle(CallbackRecord& record, bool more) noexcept {
  if (record.removed) return record.let_go();
  if (record.is_timer()) {
    record.held.store(false, std::memory_order_relaxed);
    return arm(record);
  }
  if (!more && record.drained) {
    record.drained = false;
    record.queued.store(false);
    more = record.entity->ready_count() != 0;
  }
  if (!more && !record.announced_again) {
    record.held.store(false, std::memory_order_relaxed);
    return;
  }
  Arrival arrival{next_sequence(), now_};
  record.entity->front(arrival);
  if (!is_wait_set()) {
    record.arrived(arrival);
    push(record);
    return;
  }
  // Into the next snapshot, with the announcement that was not answered or a new one.
  record.held.store(false, std::memory_order_relaxed);
  if (std::exchange(record.drained, false)) {
    record.announced = arrival;
    inbox_.push(record);
  } else {
    announce(record, arrival);
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
