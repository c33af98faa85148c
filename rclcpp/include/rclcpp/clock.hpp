// Clocks of three types; the clock of a node follows simulated time.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CLOCK_HPP_
#define RCLCPP__CLOCK_HPP_

#include <functional>
#include <memory>
#include <thread>

#include "takt/base/simulated_clock.hpp"

#include "rclcpp/context.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/time.hpp"

namespace rclcpp {

/// Calls the user's callbacks after each jump of simulated time, on a thread of its own, for the
/// lifetime of the handler. Jumps during a callback are reported as one. The destructor waits for a
/// running callback, unless that callback waits for the destructor. Thread safety: any thread may
/// destroy it. Real-time: no.
class JumpHandler {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS_NOT_COPYABLE(JumpHandler)
  using pre_callback_t = std::function<void()>;
  using post_callback_t = std::function<void(const rcl_time_jump_t&)>;

  JumpHandler(std::shared_ptr<takt::SimulatedClock> clock, pre_callback_t pre_callback,
              post_callback_t post_callback, const rcl_jump_threshold_t& threshold);
  ~JumpHandler();

 private:
  class Watch;
  const std::shared_ptr<Watch> watch_;
  std::thread thread_;
};

/// Thread safety: every method from any thread, except assignment.
/// Real-time: reading the time; the other methods may sleep or allocate.
class Clock {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Clock)

  explicit Clock(rcl_clock_type_t type = RCL_SYSTEM_TIME);
  /// A clock of type RCL_ROS_TIME: the time of `simulated` while that simulates, else system time.
  explicit Clock(std::shared_ptr<takt::SimulatedClock> simulated);

  Time now() const;
  rcl_clock_type_t get_clock_type() const noexcept { return type_; }
  bool ros_time_is_active() const;
  /// Whether it has a time: a simulated clock has none until it was set.
  bool started() const { return now().nanoseconds() != 0; }

  /// False when the context was shut down, or simulated time began or ended meanwhile. Throws
  /// std::runtime_error when the time is of another kind of clock.
  bool sleep_until(Time until, Context::SharedPtr context = contexts::get_global_default_context());
  bool sleep_for(Duration duration,
                 Context::SharedPtr context = contexts::get_global_default_context());
  bool wait_until_started(Context::SharedPtr context = contexts::get_global_default_context());
  bool wait_until_started(const Duration& timeout,
                          Context::SharedPtr context = contexts::get_global_default_context(),
                          const Duration& wait_tick = Duration(0, 10'000'000));

  /// Either callback may be empty; the first is called right before the second.
  [[nodiscard]] JumpHandler::SharedPtr create_jump_callback(
      JumpHandler::pre_callback_t pre_callback, JumpHandler::post_callback_t post_callback,
      const rcl_jump_threshold_t& threshold);

  // For this library.
  /// nullptr: this clock is not of type RCL_ROS_TIME.
  const std::shared_ptr<takt::SimulatedClock>& simulated() const noexcept { return simulated_; }
  /// The time now, and its source: real or simulated.
  takt::SourceTime read() const;
  /// The Takt clock of this clock's timers.
  takt::Clock& takt_clock() const;

 private:
  rcl_clock_type_t type_;
  std::shared_ptr<takt::SimulatedClock> simulated_;
};

namespace detail {
/// System time; in a simulated program, the virtual time.
std::chrono::system_clock::time_point system_now();
}  // namespace detail

}  // namespace rclcpp

#endif  // RCLCPP__CLOCK_HPP_
