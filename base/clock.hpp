// Where time comes from. Nothing in Takt reads a clock but through this interface.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_CLOCK_HPP_
#define TAKT_BASE_CLOCK_HPP_

#include "takt/base/time.hpp"

namespace takt {

class ManualClock;
class SimulatedClock;

/// A source of monotonic time.
/// Thread safety: every method may be called from any thread.
/// Real-time: `now()` neither blocks, nor allocates, nor makes a system call (vDSO).
class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const noexcept = 0;
  /// The clock as a manual one, or nullptr; executors choose their wait back end by it.
  virtual ManualClock* as_manual() noexcept { return nullptr; }
  /// The clock as a simulated one, or nullptr: no thread can sleep on it.
  virtual SimulatedClock* as_simulated() noexcept { return nullptr; }
  /// The clock itself, or the one that stands behind a simulated one: messages and answers are on
  /// their way in real time, and executors sleep in it.
  virtual Clock& real() noexcept { return *this; }

  /// CLOCK_MONOTONIC, shared by the whole process.
  static Clock& steady() noexcept;
};

/// CPU time that the calling thread has used, for work measured in CPU time instead of wall time.
Nanoseconds thread_cpu_time() noexcept;

/// Uses `amount` of the calling thread's CPU time; being preempted does not count as work done.
void burn_cpu(Nanoseconds amount) noexcept;

}  // namespace takt

#endif  // TAKT_BASE_CLOCK_HPP_
