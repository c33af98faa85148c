// A clock that only a test advances, and that lets one thread run at a time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_MANUAL_CLOCK_HPP_
#define TAKT_BASE_MANUAL_CLOCK_HPP_

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Virtual time with a baton: of all participating threads exactly one runs at any moment, selected
/// by (virtual wake-up time, rank). So a program with N executor threads gives the same trace on
/// every run.
///
/// 1. An executor's worker joins; it stands still until the controller (the test) advances.
/// 2. `advance(d)` hands the baton to the first participant that can run and waits until it
///    blocks again, in `wait` or in `work`; when none can run, time jumps to the next wake-up.
/// 3. `advance` returns when the target is reached and every participant is blocked.
///
/// With CPUs, participants also compete for them as threads do: one that is awake or in `work`
/// needs one of the CPUs that it may use, and the less urgent one stops meanwhile. So a test can
/// simulate preemption: SCHED_DEADLINE before SCHED_FIFO, the earlier deadline or larger priority
/// first, equal ones in order of waking up. Without CPUs, each participant has one of its own.
///
/// Thread safety: every method may be called from any thread.
/// Real-time: no; for tests and simulation only.
class ManualClock final : public Clock {
 public:
  /// One thread that takes part. The object belongs to that thread's wait back end.
  class Participant {
   public:
    Participant() = default;
    Participant(const Participant&) = delete;
    Participant& operator=(const Participant&) = delete;

    /// Of participants that can run at the same time, the one with the smaller rank runs first.
    std::pair<std::uint64_t, std::uint64_t> rank;
    /// How urgent the thread is: its relative deadline (0: none), its priority (0: none).
    Nanoseconds deadline{0};
    int priority = 0;
    std::vector<int> cpus;  // that it may use; empty: all

   private:
    friend class ManualClock;
    enum class State { absent, blocked, running };
    State state_ = State::absent;
    TimePoint wake_time_ = kNever;
    bool token_ = false;     // a wake-up that has not been consumed
    bool wakeable_ = false;  // blocked in wait(), not in work()
    // With CPUs: whether it needs one, since when, for how long yet, and whether it has it.
    bool is_awake_ = false;
    TimePoint awake_since_{};
    Nanoseconds remaining_{0};
    bool has_cpu_ = false;
    std::condition_variable released_;
  };

  explicit ManualClock(TimePoint start = TimePoint{}, std::vector<int> cpus = {})
      : now_(start), cpus_(std::move(cpus)) {}

  TimePoint now() const noexcept override;
  ManualClock* as_manual() noexcept override { return this; }

  /// Lets everything happen that is due within `duration`, then stands at its end.
  void advance(Nanoseconds duration);
  /// Lets everything happen that is due now.
  void settle() { advance(Nanoseconds::zero()); }
  /// Blocks (in real time) until that many threads have joined.
  void wait_for_participants(std::size_t count);

  /// "This took `duration`": inside a participant, the others run meanwhile; elsewhere the clock
  /// simply moves.
  void work(Nanoseconds duration);

  // For wait back ends.
  void join(Participant& self);
  void leave(Participant& self) noexcept;
  /// Blocks until `deadline` or a wake-up; true when it was a wake-up.
  bool wait(Participant& self, TimePoint deadline) noexcept;
  void wake(Participant& self) noexcept;

 private:
  void block(Participant& self, std::unique_lock<std::mutex>& lock) noexcept;
  Participant* next_due(TimePoint limit) noexcept;
  void share_cpus();

  mutable std::mutex mutex_;
  std::condition_variable baton_back_;
  TimePoint now_;
  const std::vector<int> cpus_;
  std::vector<Participant*> participants_;  // by rank
  Participant* running_ = nullptr;
};

}  // namespace takt

#endif  // TAKT_BASE_MANUAL_CLOCK_HPP_
