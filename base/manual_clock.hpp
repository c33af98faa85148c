// A clock that only a test advances, and that lets one thread run at a time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_MANUAL_CLOCK_HPP_
#define TAKT_BASE_MANUAL_CLOCK_HPP_

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/cpu_model.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Virtual time with a baton: of all participating threads exactly one runs at any moment, selected
/// by (virtual wake-up time, rank). So a program with N executor threads gives the same trace on
/// every run.
///
/// 1. An executor's worker joins; it stands still until the controller (the test) advances.
/// 2. `advance(d)` hands the baton to the first participant that can run. When that blocks, in
///    `wait` or in `work`, it hands the baton to the next one, or goes on itself; when none can
///    run, time jumps to the next event.
/// 3. The one that finds that nothing happens before the target gives the baton back: `advance`
///    returns, and every participant is blocked.
///
/// With CPUs, participants also compete for them as threads do, see CpuModel. So a test can
/// simulate preemption. Without CPUs, each participant has one of its own.
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
    std::string name;  // for use()
    /// As a thread of the CPUs, if there are some. It is set before it joins.
    CpuModel::Thread thread;

   private:
    friend class ManualClock;
    enum class State { absent, sleeping, searching, working, running };
    State state_ = State::absent;
    TimePoint wake_time_ = kNever;  // of one that waits; without CPUs, also of one that works
    bool token_ = false;            // a wake-up that has not been consumed
    std::atomic<std::uint32_t> has_baton_{0};
  };

  explicit ManualClock(TimePoint start = TimePoint{}) : now_(start) {}
  /// Without CPUs in the list, each participant has one of its own.
  ManualClock(TimePoint start, CpuModel::Options cpus);
  /// The same, with CPUs of speed 1.
  ManualClock(TimePoint start, const std::vector<int>& cpus);

  /// Whether there are CPUs: then threads ask the system for nothing.
  bool has_cpus() const noexcept { return cpus_.has_value(); }
  std::size_t cpus() const noexcept { return cpus_ ? cpus_->cpus() : 0; }

  TimePoint now() const noexcept override;
  ManualClock* as_manual() noexcept override { return this; }

  /// Lets everything happen that is due within `duration`, then stands at its end; or where it is
  /// when another thread sets `stops`.
  void advance(Nanoseconds duration, const std::atomic<bool>* stops = nullptr);
  /// Lets everything happen that is due now.
  void settle(const std::atomic<bool>* stops = nullptr) { advance(Nanoseconds::zero(), stops); }
  /// By a participant: the advance() that is under way ends at that time, if not earlier. The one
  /// that advances sees by now() that it has.
  void end_by(TimePoint time) noexcept;
  /// Blocks (in real time) until that many threads have joined.
  void wait_for_participants(std::size_t count);

  /// "This took `duration`": inside a participant, the others run meanwhile; elsewhere the clock
  /// simply moves.
  void work(Nanoseconds duration);
  /// The same, for as long on a slow CPU: a wait, for which the thread keeps its CPU.
  void occupy(Nanoseconds duration);

  /// What a thread has had of the CPUs.
  struct Use {
    std::string name;
    Nanoseconds time{0};
    const CpuModel::Thread* thread = nullptr;
  };
  /// Of all that take part, by rank.
  std::vector<Use> use() const;
  /// That the calling thread is; nullptr: it takes no part.
  static const CpuModel::Thread* this_thread() noexcept;
  /// See CpuModel. While it does not advance.
  void end_overheads() noexcept {
    if (cpus_) cpus_->end_overheads();
  }
  /// See CpuModel. Before it advances.
  void record(std::vector<CpuModel::Change>& changes) noexcept {
    if (cpus_) cpus_->record(changes);
  }
  /// While it lives, work() of the calling thread takes no time: somebody else counts it.
  class CountedElsewhere {
   public:
    CountedElsewhere() noexcept;
    ~CountedElsewhere();
    CountedElsewhere(const CountedElsewhere&) = delete;
    CountedElsewhere& operator=(const CountedElsewhere&) = delete;
  };

  // For wait back ends.
  void join(Participant& self);
  void leave(Participant& self) noexcept;
  /// Blocks until `deadline` or a wake-up; true when it was a wake-up.
  bool wait(Participant& self, TimePoint deadline) noexcept;
  /// The same, but it keeps its CPU, so it needs no time to go on.
  bool search(Participant& self, TimePoint deadline) noexcept;
  void wake(Participant& self) noexcept;

 private:
  using State = Participant::State;

  void spend(Nanoseconds duration, bool is_work);
  void block(Participant& self, State state, std::unique_lock<std::mutex>& lock) noexcept;
  void pass_on(Participant* self, std::unique_lock<std::mutex>& lock) noexcept;
  Participant* step() noexcept;
  TimePoint next_event(const Participant& participant) const noexcept;
  bool happen(Participant& participant) noexcept;
  TimePoint after_wake_up(TimePoint time) const noexcept;

  mutable std::mutex mutex_;
  std::condition_variable controller_;
  std::atomic<TimePoint> now_;
  std::optional<CpuModel> cpus_;
  std::vector<Participant*> participants_;  // by rank
  Participant* running_ = nullptr;
  bool is_advancing_ = false;
  TimePoint target_{};  // while it advances
  const std::atomic<bool>* stops_ = nullptr;
};

}  // namespace takt

#endif  // TAKT_BASE_MANUAL_CLOCK_HPP_
