// A clock that follows another source: a simulator, or the player of a recording.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SIMULATED_CLOCK_HPP_
#define TAKT_BASE_SIMULATED_CLOCK_HPP_

#include <atomic>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"

namespace takt {

/// Stands still until it is set. Threads do not sleep on it: when it is set, it notifies threads
/// that wait for a time, and they check the time.
///
/// Jumps: forward, a timer that has become due has one release, and the releases in between are
/// missed. Back by d, every release moves back by d too, so what was due in 100 ms still is.
///
/// Thread safety: every method from any thread; `set` by one at a time.
/// Real-time: now is an atomic load. set calls each listener, under a lock with priority
/// inheritance.
class SimulatedClock final : public Clock {
 public:
  class Listener {
   public:
    /// Time goes on; negative: it jumps back by so much. Neither blocks nor allocates.
    virtual void time_set(Nanoseconds change) noexcept = 0;

   protected:
    ~Listener() = default;
  };

  explicit SimulatedClock(Clock& real = Clock::steady()) : real_(real) {}
  TimePoint now() const noexcept override { return now_.load(); }
  SimulatedClock* as_simulated() noexcept override { return this; }
  Clock& real() noexcept override { return real_; }
  void set(TimePoint now) noexcept;
  /// The time of the last set(), on the real clock.
  TimePoint last_set() const noexcept { return last_set_.load(); }

  void add(Listener& listener);
  void remove(Listener& listener) noexcept;

 private:
  Clock& real_;
  std::atomic<TimePoint> now_{TimePoint{}}, last_set_{TimePoint{}};
  PiMutex mutex_;
  std::vector<Listener*> listeners_;
};

}  // namespace takt

#endif  // TAKT_BASE_SIMULATED_CLOCK_HPP_
