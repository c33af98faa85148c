// Clocks of three kinds; that of a node follows simulated time.
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

/// Calls when simulated time jumps, for as long as it lives: on a thread of its own, after the
/// jump. Jumps that come while a callback runs are reported as one. When it has gone, no callback
/// runs, but one that waits for the caller. Thread safety: it may go on any thread. Real-time: no.
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

/// Thread safety: every method from any thread.
/// Real-time: now; the rest sleeps.
class Clock {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Clock)

  explicit Clock(rcl_clock_type_t type = RCL_SYSTEM_TIME);
  /// Of RCL_ROS_TIME, which is this clock's while that simulates, else the system's.
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
  /// nullptr: it is none of ROS time.
  const std::shared_ptr<takt::SimulatedClock>& simulated() const noexcept { return simulated_; }
  /// Now, with the source that it is of.
  takt::SourceTime read() const;
  /// What timers of this clock wait by.
  takt::Clock& takt_clock() const;

 private:
  const rcl_clock_type_t type_;
  const std::shared_ptr<takt::SimulatedClock> simulated_;
};

namespace detail {
/// Of the system; of a program that is simulated, the virtual time.
std::chrono::system_clock::time_point system_now();
}  // namespace detail

}  // namespace rclcpp

#endif  // RCLCPP__CLOCK_HPP_
