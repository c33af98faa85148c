// Timers, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TIMER_HPP_
#define RCLCPP__TIMER_HPP_

#include <chrono>
#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "takt/entities/timer.hpp"
#include "takt/nodes/node.hpp"

#include "rclcpp/clock.hpp"
#include "rclcpp/context.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/macros.hpp"

namespace rclcpp {

/// Both are the time of the call: Takt does not report when the timer was due.
struct TimerInfo {
  Time expected_call_time;
  Time actual_call_time;
};

namespace detail {
/// The period in nanoseconds, at least 1. Throws std::invalid_argument when it is negative or too
/// long.
template <class Rep, class Period>
std::chrono::nanoseconds timer_period(std::chrono::duration<Rep, Period> period) {
  using Wide = std::chrono::duration<long double, std::nano>;
  if (period < decltype(period)::zero()) {
    throw std::invalid_argument("timer period cannot be negative");
  }
  if (Wide(period) > Wide(std::chrono::nanoseconds::max())) {
    throw std::invalid_argument("timer period must be less than std::chrono::nanoseconds::max()");
  }
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(period);
  return ns > std::chrono::nanoseconds::zero() ? ns : std::chrono::nanoseconds(1);
}
}  // namespace detail

class TimerBase;
using VoidCallbackType = std::function<void()>;
using TimerCallbackType = std::function<void(TimerBase&)>;
using TimerInfoCallbackType = std::function<void(const TimerInfo&)>;

/// Thread safety: every method from any thread, also from the callback, once it has a node: before,
/// they throw std::runtime_error. Real-time: as takt::Timer.
class TimerBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(TimerBase)
  virtual ~TimerBase() = default;
  TimerBase& operator=(const TimerBase&) = delete;

  void cancel() { entity()->cancel(); }
  bool is_canceled() { return entity()->is_canceled(); }
  void reset() { entity()->reset(); }
  bool is_ready() { return !is_canceled() && timer_->due() <= timer_->clock().now(); }
  /// The longest duration when the timer is cancelled.
  std::chrono::nanoseconds time_until_trigger() {
    if (is_canceled()) return std::chrono::nanoseconds::max();
    return takt::between(timer_->clock().now(), timer_->due());
  }
  bool is_steady() { return clock_->get_clock_type() == RCL_STEADY_TIME; }
  Clock::SharedPtr get_clock() const { return clock_; }
  /// For use without an executor: takes the release that is due; nullptr if there is none.
  std::shared_ptr<void> call();
  void execute_callback(const std::shared_ptr<void>& = nullptr) { (*call_)(*this); }

  RCLCPP_REFUSED_(get_timer_handle, "rcl's handles")
  RCLCPP_REFUSED_(set_on_reset_callback, "callbacks for what is new")

  // For this library.
  const std::shared_ptr<takt::Timer>& entity() const {
    if (timer_ == nullptr) {
      throw std::runtime_error("timer has no node: give it to NodeTimersInterface::add_timer");
    }
    return timer_;
  }
  std::chrono::nanoseconds period() const { return period_; }
  /// Makes Takt's timer. Throws std::runtime_error if there is one.
  void add_to(takt::Node& node, const std::string& name,
              std::shared_ptr<takt::CallbackGroup> group);

 protected:
  /// Throws std::invalid_argument if there is no clock.
  TimerBase(Clock::SharedPtr clock, std::chrono::nanoseconds period, TimerCallbackType call,
            bool autostart);

 private:
  TimerBase(const TimerBase&) = default;

  const Clock::SharedPtr clock_;
  const std::chrono::nanoseconds period_;
  const std::shared_ptr<const TimerCallbackType> call_;
  const bool autostart_;
  std::shared_ptr<takt::Timer> timer_;
};

template <class F>
class GenericTimer : public TimerBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(GenericTimer)
  /// A node must be given to it. The context is not used: it is that of the node.
  GenericTimer(Clock::SharedPtr clock, std::chrono::nanoseconds period, F callback,
               const Context::SharedPtr&, bool autostart = true)
      : TimerBase(std::move(clock), detail::timer_period(period), caller(std::move(callback)),
                  autostart) {}

 private:
  static TimerCallbackType caller(F callback) {
    return [callback = std::move(callback)](TimerBase& self) mutable {
      if constexpr (std::invocable<F&>) {
        callback();
      } else if constexpr (std::invocable<F&, TimerBase&>) {
        callback(self);
      } else {
        static_assert(std::invocable<F&, const TimerInfo&>,
                      "a timer's callback takes nothing, rclcpp::TimerBase& or "
                      "const rclcpp::TimerInfo&: see docs/reference/rclcpp.md");
        const Time now = self.get_clock()->now();
        callback(TimerInfo{now, now});
      }
    };
  }
};
template <class F>
class WallTimer : public GenericTimer<F> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(WallTimer)
  WallTimer(std::chrono::nanoseconds period, F callback, const Context::SharedPtr& context,
            bool autostart = true)
      : GenericTimer<F>(std::make_shared<Clock>(RCL_STEADY_TIME), period, std::move(callback),
                        context, autostart) {}
};

}  // namespace rclcpp

#endif  // RCLCPP__TIMER_HPP_
