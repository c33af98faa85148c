// The interface of clocks. All code in Takt reads the time through it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_CLOCK_HPP_
#define TAKT_BASE_CLOCK_HPP_

#include <memory>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

class ManualClock;
class SimulatedClock;

/// A source of monotonic time.
/// Thread safety: every method may be called from any thread.
/// Real-time: `now()` neither blocks, nor allocates, nor makes a system call (vDSO).
class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const noexcept = 0;
  /// The clock as a manual one, or nullptr. Executors choose their wait back end by it.
  virtual ManualClock* as_manual() noexcept { return nullptr; }
  /// The clock as a simulated one, or nullptr: no thread can sleep on it. The pointer keeps it if a
  /// shared pointer does.
  virtual std::shared_ptr<SimulatedClock> as_simulated() noexcept { return nullptr; }
  /// The real clock: the clock itself, or the one that a simulated clock is based on. Transport
  /// takes real time, and executors sleep in real time.
  virtual Clock& real() noexcept { return *this; }
  /// Its time without jumps, by which timers and coroutines wait. Most clocks do not jump.
  virtual Clock& timeline() noexcept { return *this; }
  /// Where `time`, of this clock, is on the timeline if the clock does not jump before.
  virtual TimePoint on_timeline(TimePoint time) const noexcept { return time; }

  /// CLOCK_MONOTONIC, shared by the whole process.
  static Clock& steady() noexcept;
};

/// CPU time that the calling thread has used, for work measured in CPU time instead of wall time.
Nanoseconds thread_cpu_time() noexcept;

/// Keeps the calling thread busy until it has used this much CPU time; preempted time does not
/// count.
void burn_cpu(Nanoseconds amount) noexcept;

}  // namespace takt

#endif  // TAKT_BASE_CLOCK_HPP_
