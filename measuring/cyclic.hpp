// Measures the wake-up latency of a periodic thread as cyclictest does: of the bare system call and
// of executors.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_CYCLIC_HPP_
#define TAKT_MEASURING_CYCLIC_HPP_

#include <atomic>
#include <cstdint>
#include <ctime>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/base/realtime_scope.hpp"
#include "takt/measuring/over_time.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {

/// Options for all variants of one test.
struct CyclicOptions {
  ThreadAttributes thread;  // its name is that of an executor's node, too; empty: latency
  Realtime realtime = Realtime::prefer;
  Nanoseconds interval = std::chrono::milliseconds(1);
  Nanoseconds bin = std::chrono::microseconds(1);  // width of a bin
  std::size_t bins = 10'000;
  Nanoseconds break_above{0};         // a longer latency ends the test; 0: never
  bool relative = false;              // the bare loop sleeps for the interval, not until a time
  bool uses_nanosleep = false;        // of the bare loop, which is relative then
  clockid_t clock = CLOCK_MONOTONIC;  // of the bare loop
  int trace_marker = -1;              // a file that is written to when a latency has ended the test
  bool keeps_values = false;          // of a round
};

/// The measurements of one variant in all its rounds.
struct CyclicResult {
  explicit CyclicResult(const CyclicOptions& options);

  std::string name;
  Rounds rounds;
  std::optional<OverTime> over_time;           // if it is asked for, see CyclicVariant::expect
  std::vector<std::uint64_t> bins;             // exact counts, as cyclictest prints them
  std::uint64_t overflows = 0;                 // above the last bin
  std::vector<std::uint64_t> overflow_cycles;  // the numbers of the first such cycles
  std::uint64_t cycles = 0;
  std::uint64_t early = 0;   // wake-ups before the programmed time; must be 0
  std::uint64_t missed = 0;  // periods that passed without a wake-up
  Nanoseconds min{INT64_MAX}, last{0}, max{INT64_MIN}, sum{0};
  bool broke = false;  // stopped by break_above
  ThreadState in_force;
  ThreadCounters counters;
  Nanoseconds cpu_time{0}, wall_time{0};

  Nanoseconds mean() const noexcept;
  double cpu_percent() const noexcept;
  /// Counts a latency in all members except `rounds` and `over_time`. Allocates nothing, for the
  /// measured thread. Returns false if the test must end.
  bool record(Nanoseconds latency) noexcept;

 private:
  Nanoseconds bin_, break_above_;
};

/// A method of periodic wake-up. Its rounds alternate with those of other variants.
class CyclicVariant {
 public:
  virtual ~CyclicVariant() = default;
  /// Measures this many cycles, or fewer if `stop` becomes true. Throws Error if required real-time
  /// privileges are refused.
  void round(std::uint64_t cycles, const std::atomic<bool>& stop);
  /// The next round ends about so long after the beginning of the measurement: from now on, the
  /// result has latencies by time.
  void expect(TimePoint beginning, Nanoseconds end);
  const CyclicResult& result() const noexcept { return result_; }
  const CyclicOptions& options() const noexcept { return options_; }
  /// The latencies of the last round, if the options keep them.
  const std::vector<Nanoseconds>& values() const noexcept { return values_; }

 protected:
  CyclicVariant(const CyclicOptions& options, const std::string& name);
  /// Calls record() for each cycle.
  virtual void run(std::uint64_t cycles, const std::atomic<bool>& stop) = 0;
  bool record(Nanoseconds latency, TimePoint woken) noexcept {
    if (round_.count() == 0) first_woken_ = woken;
    if (result_.over_time)
      result_.over_time->record(round_begin_ + (woken - first_woken_), latency);
    round_.record(latency);
    if (values_.size() < values_.capacity()) values_.push_back(latency);
    if (result_.record(latency)) return true;
    mark(latency);
    return false;
  }
  /// In the kernel's trace, at once: later, what has caused the latency is overwritten.
  void mark(Nanoseconds latency) const noexcept;

  const CyclicOptions options_;
  CyclicResult result_;

 private:
  Histogram round_;
  TimePoint beginning_{}, first_woken_{};  // of the measurement; of the round
  Nanoseconds round_begin_{0};             // since the beginning of the measurement
  std::vector<Nanoseconds> values_;
};

/// clock_nanosleep as in cyclictest: the lower bound for executors.
std::unique_ptr<CyclicVariant> bare_loop(const CyclicOptions& options);
/// A timer callback of an executor whose first thread has the attributes.
std::unique_ptr<CyclicVariant> executor_timer(const CyclicOptions& options,
                                              const std::string& executor,
                                              Nanoseconds early_wake = Nanoseconds::zero());

/// What a number of cycles is about, where rows have different intervals.
enum class CyclesOf { each, first };  // first: the others as many as fit into its time

/// A round of all these rows at the same time, each on its thread. One that breaks or throws sets
/// `stop`, which ends the others. Throws what a row throws.
void run_together(std::span<const std::unique_ptr<CyclicVariant>> rows, std::uint64_t cycles,
                  CyclesOf of, std::atomic<bool>& stop);

/// Gaps in the execution of a thread that only reads the clock: preemption by threads of higher
/// priority, interrupts, the host of a virtual machine, firmware (SMI).
struct Gaps {
  static constexpr Nanoseconds kThreshold = std::chrono::microseconds(20);
  std::uint64_t count = 0;  // longer than the threshold
  Nanoseconds longest{0}, total{0}, observed{0};
};
/// Polls the clock for this time, which blocks all threads of lower priority on that CPU.
void find_gaps(const CyclicOptions& options, Nanoseconds duration, Gaps& gaps);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_CYCLIC_HPP_
