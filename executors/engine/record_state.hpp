// The life of a record: one word that holds its state, and one reference count.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_RECORD_STATE_HPP_
#define TAKT_EXECUTORS_ENGINE_RECORD_STATE_HPP_

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace takt::detail {

/// Where a record is, and whether it is removed. Its transitions, at a dispatch point, or on a
/// control thread while no thread spins:
///
/// - idle → ready        make_ready(): a worker finds it ready; it goes to the scheduler
/// - idle → ready        drain(): another thread has announced it; it was in the inbox
/// - ready → parked      park(): its group is busy
/// - parked → ready      unpark(): its group is free, and it is the first
/// - ready → running     begin(): a worker has picked it; one execution more
/// - running → ready     settle(): there is more to take
/// - running → idle      settle(): there is nothing more
/// - any → the same, removed   remove(): the update without it is installed
///
/// Any other transition ends the process. A record is `running` until it is settled: in a reentrant
/// group when its input is taken, otherwise when its callback has returned. So a reentrant group's
/// record may be idle, or ready again, while some executions of it have not ended.
///
/// The mark says that another thread has announced the record, until settling clears it; for the
/// first part of that time the record is in the inbox. A thread that announces has first raised the
/// level (the entity has input), then reads the mark; settling first clears the mark, then reads
/// the level. Both are sequentially consistent, so one of the two sees the other (as in Dekker's
/// algorithm). Dispatches write the cache line of the mark only to clear it, so an announcement to
/// a busy callback costs one load; and as all else is written by the executor alone, a worker's own
/// announcements cost no atomic operation. "Again": the worker has announced the record while it
/// was running.
///
/// A record that is removed is announced by nobody, and is in no scheduler; the inbox skips it. Its
/// remover waits until it `is_over`: no execution is left. Then one thread detaches it.
///
/// Thread safety: announce, references and the observers from any thread; what follows a removal
/// from the threads that wait for it; all else is serialised by the executor.
/// Real-time: nothing blocks but the two waits of control threads.
class RecordState {
 public:
  enum State : std::uint32_t { idle, ready, parked, running };
  /// Whether the record is announced. It is beside the state, in another cache line.
  using Mark = std::atomic<bool>;

  // ---- Any thread ----

  /// True: the caller puts it into the inbox.
  static bool announce(Mark& mark) noexcept { return !mark.load() && !mark.exchange(true); }
  State state() const noexcept { return State(word_.load() & kStates); }
  bool is_removed() const noexcept { return (word_.load() & kRemoved) != 0; }
  bool is_executing() const noexcept { return word_.load() >= kExecution; }
  /// It is removed, and no execution is left.
  bool is_over() const noexcept {
    const std::uint32_t word = word_.load();
    return (word & kRemoved) != 0 && word < kExecution;
  }
  bool is_detached() const noexcept { return (word_.load() & kDetached) != 0; }

  // ---- Serialised: at a dispatch point ----

  /// False: the record is in the inbox, or not idle: its input is seen later.
  bool make_ready(const Mark& mark) noexcept {
    const std::uint32_t word = own();
    const std::uint32_t state = word & (kStates | kRemoved);
    if (state == idle && !mark.load(std::memory_order_relaxed)) {
      write(word + ready);
      return true;
    }
    if (state == running) write(word | kAgain);
    return false;
  }
  /// The record was in the inbox. False: it is not idle; settling will read the level.
  bool drain() noexcept {
    const std::uint32_t word = own() | kDrained;
    const bool is_idle = (word & kStates) == idle;
    write(is_idle ? word + ready : word);
    return is_idle;
  }
  /// The same for a timer. The caller reads its release time afterwards, so a thread that changes
  /// that later announces it again. An idle timer is armed now, any other when it is settled.
  static void set_again(Mark& mark) noexcept { mark.store(false); }
  void park() noexcept { change(ready, parked); }
  void unpark() noexcept { change(parked, ready); }
  void begin() noexcept { write(expect(ready) - ready + running + kExecution); }
  /// `more`: there was more when the input was taken. `level`: whether there is more now. `ended`:
  /// how many executions end here, 0 or 1. Returns true if the record goes to the scheduler.
  template <class Level>
  bool settle(Mark& mark, bool more, std::uint32_t ended, Level&& level) noexcept {
    std::uint32_t word = expect(running) - ended * kExecution;
    if (!more && (word & kDrained) != 0) {
      word -= kDrained;
      mark.store(false);
      more = level();
    }
    more = more || (word & kAgain) != 0;
    write((word & ~(kStates | kAgain)) + (more ? ready : idle));
    return more;
  }
  /// An execution ends whose record is settled already (reentrant groups), or removed.
  void end_execution() noexcept {
    if (is_removed()) {
      word_.fetch_sub(kExecution);  // threads that wait for its end write, too
    } else {
      write(own() - kExecution);
    }
  }
  /// Leaves the mark set for ever, so that nobody announces the record any more.
  void remove(Mark& mark) noexcept {
    if (is_removed()) return;
    const bool is_in_inbox = mark.exchange(true) && (own() & kDrained) == 0;
    write(own() | kRemoved | (is_in_inbox ? kInInbox : 0));
  }
  /// A removed record was taken from the inbox.
  void discard() noexcept { word_.fetch_sub(kInInbox); }
  /// No part of the ready set refers to it any more.
  bool has_left() const noexcept { return is_over() && (word_.load() & kInInbox) == 0; }

  // ---- Threads that wait for its end ----

  /// True: the caller detaches the entity, and then calls set_detached.
  bool begin_to_detach() noexcept { return (word_.fetch_or(kDetaching) & kDetaching) == 0; }
  void set_detached() noexcept {
    word_.fetch_or(kDetached);
    word_.notify_all();
  }
  void wait_until_detached() const noexcept {
    for (std::uint32_t word = word_.load(); !is_detached(); word = word_.load()) word_.wait(word);
  }

  // ---- References: a record without any is freed by a control thread ----

  void retain() noexcept { references_.fetch_add(1); }
  /// The caller's last access.
  void release() noexcept { references_.fetch_sub(1); }
  bool is_unused() const noexcept { return references_.load() == 0; }

 private:
  static constexpr std::uint32_t kStates = 3, kAgain = 4, kDrained = 8, kRemoved = 16,
                                 kInInbox = 32, kDetaching = 64, kDetached = 128;
  static constexpr std::uint32_t kExecution = 256;  // the rest of the word counts executions

  std::uint32_t own() const noexcept { return word_.load(std::memory_order_relaxed); }
  std::uint32_t expect(State from) const noexcept {
    const std::uint32_t word = own();
    if ((word & (kStates | kRemoved)) != from) [[unlikely]]
      refuse();
    return word;
  }
  void change(State from, State to) noexcept { write(expect(from) - from + to); }
  // Release: pairs with the loads of observers. The input is taken later, by an atomic operation: a
  // thread that sees it taken also sees the callback execute.
  void write(std::uint32_t word) noexcept { word_.store(word, std::memory_order_release); }
  [[noreturn, gnu::cold, gnu::noinline]] static void refuse() noexcept { std::abort(); }

  std::atomic<std::uint32_t> word_{idle};
  // One each for the executor's list of callbacks, the ready set, a period that runs the record,
  // and every thread that removes it or waits for its removal.
  std::atomic<std::uint32_t> references_{1};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_RECORD_STATE_HPP_
