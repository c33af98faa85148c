// Which virtual thread has which virtual CPU: what Linux' scheduler does, as numbers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_CPU_MODEL_HPP_
#define TAKT_BASE_CPU_MODEL_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Virtual CPUs, and the threads that need one. What it does, in the words of sched(7):
///
/// 1. Threads of SCHED_DEADLINE come first, the earliest deadline before others, on any CPU. Each
///    is a constant bandwidth server: a thread that wakes up too late for what is left of its
///    budget gets a new one; one that has used it up waits for the end of its period.
/// 2. Then SCHED_FIFO and SCHED_RR, by priority; equal ones in the order in which they woke up. A
///    thread that is preempted keeps its place; of SCHED_RR, one goes to the end when its 100 ms
///    are over. On each CPU both together get `realtime` of each second, from the beginning on.
/// 3. Then SCHED_OTHER and SCHED_BATCH, which take turns of 3 ms, more or less by their nice value,
///    and at last SCHED_IDLE. *That is a model*, and not what Linux does.
///
/// In order of urgency each gets a CPU: the one that it has, or else the one on which the least
/// urgent thread runs, at best none. A reservation stays where it was. So no thread that runs
/// moves for the sake of a less urgent one.
///
/// Time comes from outside, never backwards; each function is called with the time that it is.
/// Thread safety: none, the caller has a lock.
/// Real-time: no; for tests and simulation only.
class CpuModel {
 public:
  struct Cpu {
    int number = 0;
    double speed = 1;  // work takes so many times less
  };
  struct Options {
    std::vector<Cpu> cpus;
    /// From one thread to another. Twice of it pays a thread that was preempted: there and back.
    Nanoseconds change{0};
    /// A thread that has slept goes on so much later; or, each time, as this says instead.
    Nanoseconds wake{0};
    std::function<Nanoseconds()> drawn_wake = {};
    /// Of each second of a CPU, for SCHED_FIFO and SCHED_RR; nullopt: all.
    std::optional<Nanoseconds> realtime = {};
  };
  enum class Policy { deadline, fifo, rr, other, idle };
  static constexpr std::size_t kNone = SIZE_MAX;
  /// A turn of SCHED_RR: as long as Linux has it, unless somebody changes `sched_rr_timeslice_ms`.
  static constexpr Nanoseconds kTurn = std::chrono::milliseconds(100);

  /// One thread. It is the caller's, and lives as long as it is awake.
  class Thread {
   public:
    Thread() = default;
    Thread(const Thread&) = delete;
    Thread& operator=(const Thread&) = delete;

    Policy policy = Policy::other;
    int priority = 0;
    int nice = 0;
    struct Reservation {
      Nanoseconds runtime{0}, deadline{0}, period{0};  // deadline 0: the period
    } reservation;                                     // of Policy::deadline
    std::vector<int> cpus;  // that it may use; empty: all. Not of Policy::deadline

    bool is_awake() const noexcept { return is_awake_; }
    /// The time that it has had a CPU.
    Nanoseconds used(TimePoint now) const noexcept {
      return cpu_ == kNone ? used_ : used_ + (now - since_);
    }

   private:
    friend class CpuModel;
    bool is_awake_ = false, is_throttled_ = false;
    bool is_preempted_ = false;
    bool keeps_time_ = false;                     // its work is time, at any speed
    std::size_t cpu_ = kNone, last_cpu_ = kNone;  // by index
    std::uint64_t place_ = 0;                     // among equals
    std::int64_t work_ = 0;                       // left, in parts of a nanosecond at speed 1
    TimePoint since_{};                           // from here on it is not accounted for
    Nanoseconds budget_{0};                       // of a reservation
    TimePoint due_ = TimePoint::min();            // its deadline
    Nanoseconds slice_{0}, used_{0};
  };

  /// On a CPU, from then on, another thread runs, or none.
  struct Change {
    TimePoint time{};
    int cpu = 0;
    const Thread* before = nullptr;
    const Thread* after = nullptr;
    bool was_preempted = false;
  };

  /// Throws Error if there is no CPU, one of them twice, or with a speed that is none.
  explicit CpuModel(Options options);

  /// From here on all changes are added there.
  void record(std::vector<Change>& changes) noexcept { changes_ = &changes; }

  /// From here on it needs a CPU, for no work yet.
  void wake(Thread& thread, TimePoint now);
  /// It is awake, and goes on for so long at speed 1.
  void work(Thread& thread, Nanoseconds amount, TimePoint now);
  /// The same, for so long at any speed.
  void occupy(Thread& thread, Nanoseconds time, TimePoint now);
  /// It is awake, and needs no more time for what it does.
  void end_work(Thread& thread, TimePoint now);
  void sleep(Thread& thread, TimePoint now);
  /// When something happens to a thread that is awake; kNever: it waits for a CPU.
  TimePoint next_event(const Thread& thread) const;
  /// It happens. True: the thread has done its work, and still has its CPU.
  bool happen(Thread& thread, TimePoint now);
  std::size_t cpus() const noexcept { return states_.size(); }
  /// From here on changes and wake-ups take no time.
  void end_overheads() noexcept {
    options_.change = options_.wake = Nanoseconds::zero();
    options_.drawn_wake = nullptr;
  }
  /// Of the thread that wakes up next.
  Nanoseconds wake_overhead() const {
    return options_.drawn_wake ? options_.drawn_wake() : options_.wake;
  }

  /// When something happens to a CPU, of itself.
  TimePoint next_event() const;
  void happen(TimePoint now);

 private:
  struct State {  // of a CPU
    std::int64_t speed = 0;
    Thread* running = nullptr;
    Nanoseconds realtime_used{0};
    TimePoint second{};  // the end of the one that this counts in
    bool is_throttled = false;
  };

  bool may_use(const Thread& thread, std::size_t cpu) const;
  void account(TimePoint now);
  void begin_budget(Thread& thread, TimePoint now);
  void share(TimePoint now);
  std::size_t choose(const Thread& thread) const;
  std::int64_t speed_of(const Thread& thread) const;
  TimePoint end_of_work(const Thread& thread) const;

  Options options_;
  std::vector<State> states_;    // as the CPUs
  std::vector<Thread*> awake_;   // the most urgent first
  std::vector<Thread*> chosen_;  // while it shares: for which CPU
  std::uint64_t places_ = 0;
  std::vector<Change>* changes_ = nullptr;
};

}  // namespace takt

#endif  // TAKT_BASE_CPU_MODEL_HPP_
