// Callbacks that are due at fixed times.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_TIMER_HPP_
#define TAKT_ENTITIES_TIMER_HPP_

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "takt/base/clock.hpp"
#include "takt/entities/entity.hpp"

namespace takt {

/// A periodic timer. Its releases are start + n × period: the phase is kept whatever happens. At
/// most one release is outstanding; those that come due meanwhile are counted as missed, and the
/// timer goes on with the next one of the phase (rclcpp issue 2771: no burst after an overrun).
///
/// Thread safety: cancel, reset and the observers from any thread, the own callback included.
/// Real-time: all of it; nothing blocks or allocates.
class Timer : public Entity {
 public:
  Timer(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock, Nanoseconds period,
        std::function<void()> callback);

  /// No further release, the outstanding one included.
  void cancel() noexcept;
  /// Starts anew: the next release is one period from now.
  void reset() noexcept;
  bool is_canceled() const noexcept { return next_release_.load() == kNever; }
  Clock& clock() const noexcept { return clock_; }
  std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }

  std::size_t ready_count() const noexcept override;
  std::optional<TimePoint> next_release() const noexcept override { return next_release_.load(); }
  Nanoseconds period() const noexcept override { return period_; }
  bool take(Slot& slot) noexcept override;
  void execute(Slot& slot) override;
  Report report() const override { return {.missed = missed()}; }

 private:
  void set_release(TimePoint release) noexcept;

  Clock& clock_;
  const Nanoseconds period_;
  const std::function<void()> callback_;
  std::atomic<TimePoint> next_release_;
  std::atomic<std::uint64_t> missed_{0};
};

}  // namespace takt

#endif  // TAKT_ENTITIES_TIMER_HPP_
