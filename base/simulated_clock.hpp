// A clock that follows another source: a simulator, or the player of a recording.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SIMULATED_CLOCK_HPP_
#define TAKT_BASE_SIMULATED_CLOCK_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A time, and the source that it was read from. Times of two sources cannot be compared: what is
/// in between is nothing then. Thread safety: immutable. Real-time: yes.
class SourceTime {
 public:
  SourceTime(Nanoseconds since_epoch, std::uint32_t source) noexcept
      : since_epoch_(since_epoch), source_(source) {}

  Nanoseconds since_epoch() const noexcept { return since_epoch_; }
  std::uint32_t source() const noexcept { return source_; }
  std::optional<Nanoseconds> until(const SourceTime& other) const noexcept {
    if (source_ != other.source_) return std::nullopt;
    return between(TimePoint(since_epoch_), TimePoint(other.since_epoch_));
  }
  SourceTime after(Nanoseconds duration) const noexcept {
    return {later(TimePoint(since_epoch_), duration).time_since_epoch(), source_};
  }

 private:
  Nanoseconds since_epoch_;
  std::uint32_t source_;
};

/// While it simulates, it stands still until it is set. Threads do not sleep on it: when it is set,
/// it notifies threads that wait for a time, and they check the time. While it does not simulate,
/// it is the real clock.
///
/// Jumps: forward, a timer that has become due has one release, and the releases in between are
/// missed. Back, and where it begins or ends to simulate, the timeline stands still: so what was
/// due in 100 ms still is.
///
/// Thread safety: every method from any thread; `set` by one at a time.
/// Real-time: now is two atomic loads, and perhaps that of the real clock. set, simulate and
/// on_timeline take a lock with priority inheritance; the first two call each listener under it.
class SimulatedClock final : public Clock, public std::enable_shared_from_this<SimulatedClock> {
 public:
  class Listener {
   public:
    /// Time goes on or jumps. `is_switched`: it has begun or ended to simulate, so real times of
    /// releases are others. Neither blocks nor allocates.
    virtual void time_set(bool is_switched) noexcept = 0;

   protected:
    ~Listener() = default;
  };

  /// Sets clocks, for as long as they simulate.
  /// Thread safety: every method from any thread. Real-time: no.
  class Source {
   public:
    virtual ~Source() = default;
    /// From now on sets the clock; at once if it knows the time. Throws Error when it cannot.
    virtual void follow(const std::shared_ptr<SimulatedClock>& clock) = 0;
    virtual void leave(const SimulatedClock& clock) noexcept = 0;
  };

  /// It simulates, and its time is 0.
  explicit SimulatedClock(Clock& real = Clock::steady()) : SimulatedClock(real, true) {}
  SimulatedClock(Clock& real, bool simulates)
      : real_(real), source_(simulates ? 1 : 0), has_time_(simulates) {}

  TimePoint now() const noexcept override { return simulates() ? now_.load() : real_.now(); }
  ManualClock* as_manual() noexcept override { return simulates() ? nullptr : real_.as_manual(); }
  std::shared_ptr<SimulatedClock> as_simulated() noexcept override;
  Clock& real() noexcept override { return real_; }
  Clock& timeline() noexcept override { return timeline_; }
  TimePoint on_timeline(TimePoint time) const noexcept override;

  void set(TimePoint now) noexcept;
  /// Its time is 0 until it is set. The first time is no jump: there simulated time begins.
  void simulate(bool simulates) noexcept;
  bool simulates() const noexcept { return is_simulated(source_.load()); }

  /// The time with its source: another one each time that the clock begins or ends to simulate.
  SourceTime read() const noexcept {
    return read([this] { return real_.now().time_since_epoch(); });
  }
  /// The same with another time in place of the real clock's.
  template <class Real>
  SourceTime read(Real&& real_time) const noexcept {
    for (;;) {
      const std::uint32_t source = source_.load();
      const Nanoseconds time = is_simulated(source) ? now_.load().time_since_epoch() : real_time();
      if (source_.load() == source) return {time, source};
    }
  }
  static bool is_simulated(std::uint32_t source) noexcept { return source % 2 != 0; }

  /// The real time of a release on the timeline; in simulated time that of the last set() if it is
  /// due, else kNever.
  TimePoint real_time_of(TimePoint release) const noexcept;
  /// The timeline at a real time that has come.
  TimePoint timeline_at(TimePoint real) const noexcept;

  void add(Listener& listener);
  void remove(Listener& listener) noexcept;

 private:
  class Timeline final : public Clock {
   public:
    explicit Timeline(SimulatedClock& owner) : owner_(owner) {}
    TimePoint now() const noexcept override { return owner_.timeline_at(owner_.real_.now()); }
    ManualClock* as_manual() noexcept override { return owner_.as_manual(); }
    std::shared_ptr<SimulatedClock> as_simulated() noexcept override {
      return owner_.as_simulated();
    }
    Clock& real() noexcept override { return owner_.real_; }

   private:
    SimulatedClock& owner_;
  };

  void notify(bool is_switched) noexcept;

  Clock& real_;
  Timeline timeline_{*this};
  std::atomic<std::uint32_t> source_;  // counts the switches: odd while it simulates
  std::atomic<TimePoint> now_{TimePoint{}};
  // The timeline: in simulated time `stands_`, in real time `ahead_` of the real clock. A switch
  // changes the one that is not used yet, and then source_: so readers need no lock.
  std::atomic<TimePoint> stands_{TimePoint{}};
  std::atomic<Nanoseconds> ahead_{Nanoseconds{0}};
  std::atomic<TimePoint> last_set_{TimePoint{}};          // on the real clock
  mutable RankedMutex<LockRank::simulated_clock> mutex_;  // guards what follows, and changes
  bool has_time_;
  std::vector<Listener*> listeners_;
};

}  // namespace takt

#endif  // TAKT_BASE_SIMULATED_CLOCK_HPP_
