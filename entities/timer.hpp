// Periodic timers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_TIMER_HPP_
#define TAKT_ENTITIES_TIMER_HPP_

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "takt/base/clock.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {

/// A periodic timer. Its releases are start + n × period: it always keeps this phase. At most one
/// release is outstanding; those that come due meanwhile are counted as missed, and the timer
/// continues with the next one of the phase (rclcpp issue 2771: no burst after an overrun). With
/// CallbackParameters::releases more may be, each of which is served; of those beyond, the oldest
/// but the one that is served next are missed.
/// SimulatedClock documents its effect on timers.
///
/// Thread safety: cancel, reset and the observers from any thread, including its own callback.
/// Real-time: nothing blocks or allocates.
class Timer : public Entity, private SimulatedClock::Listener {
 public:
  using SharedPtr = std::shared_ptr<Timer>;

  Timer(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock, Nanoseconds period,
        std::function<void()> callback);
  ~Timer() override;

  /// Cancels all further releases, including the outstanding one.
  void cancel() noexcept;
  /// Restarts: the next release is one period from now.
  void reset() noexcept;
  /// Sets the next release, by clock(); later ones follow it by the period. kNever cancels.
  void release_at(TimePoint release) noexcept;
  /// The next release, by clock().
  TimePoint due() const noexcept { return next_release_.load(); }
  /// Restarts, as reset, unless the timer was cancelled or a release was given to it: for
  /// callers that make timers one by one and let them begin together, as a Container does. A
  /// release that was set meanwhile, also by the library's own alarms and timeouts, stays as it is.
  void begin_phase() noexcept;
  bool is_canceled() const noexcept { return next_release_.load() == kNever; }
  /// The timeline of its releases: that of the clock that it was made with.
  Clock& clock() const noexcept { return clock_; }
  std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }

  std::size_t ready_count() const noexcept override;
  /// In the executor's time. In simulated time: when it has become due, or kNever.
  std::optional<TimePoint> next_release() const noexcept override {
    return real_time_of(next_release_.load());
  }
  Nanoseconds period() const noexcept override { return period_; }
  bool take(Slot& slot) noexcept override;
  void execute(Slot& slot) override;
  void set_most_releases(std::uint32_t most) noexcept override { most_releases_.store(most); }
  void skip_releases(TimePoint until) noexcept override;
  Counts counts() const noexcept override { return {.missed = missed()}; }
  std::uint64_t lost() const noexcept override { return missed(); }

 protected:
  /// Restarts without a notification; a cancelled timer stays cancelled.
  void restart() noexcept;
  /// Reports to the sink that next_release() has changed.
  void notify_release_changed() noexcept;
  /// A release was taken and not served.
  void miss() noexcept { missed_.fetch_add(1, std::memory_order_relaxed); }

 private:
  TimePoint real_time_of(TimePoint release) const noexcept;
  void time_set(bool is_switched) noexcept override;

  Clock& clock_;
  const std::shared_ptr<SimulatedClock> simulated_;  // whose timeline this is; nullptr: no other's
  const Nanoseconds period_;
  const std::function<void()> callback_;
  std::atomic<TimePoint> next_release_;
  std::atomic<bool> is_given_{false};  // the next release is what release_at or cancel said
  std::atomic<std::uint32_t> most_releases_{1};
  std::atomic<std::uint64_t> missed_{0};
};

}  // namespace takt

#endif  // TAKT_ENTITIES_TIMER_HPP_
