// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/user_function.hpp"

#include "rclcpp/clock.hpp"

namespace rclcpp {

/// What the clock tells, and the thread waits for: step by step,
/// 1. the clock is set, and calls time_set under its lock, which compares with the time before;
/// 2. a jump beyond the threshold is added to what is still to be reported, and the thread is
/// woken;
/// 3. which takes that, and calls.
class JumpHandler::Watch final : takt::SimulatedClock::Listener {
 public:
  Watch(std::shared_ptr<takt::SimulatedClock> clock, pre_callback_t pre, post_callback_t post,
        const rcl_jump_threshold_t& threshold)
      : clock_(std::move(clock)),
        pre_(std::move(pre)),
        post_(std::move(post)),
        threshold_(threshold),
        last_(clock_->now()) {
    clock_->add(*this);
  }
  ~Watch() { clock_->remove(*this); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  void run() {
    for (;;) {
      const std::uint32_t seen = changes_.load();
      if (is_ended_.load()) return;
      std::optional<rcl_time_jump_t> jump;
      {
        const std::lock_guard lock(mutex_);
        std::swap(jump, untold_);
      }
      if (!jump) {
        changes_.wait(seen);
        continue;
      }
      if (pre_) pre_();
      if (post_) post_(*jump);
    }
  }
  void end() noexcept {
    is_ended_.store(true);
    wake();
  }

 private:
  void time_set(bool is_switched) noexcept override {
    const takt::TimePoint now = clock_->now();
    const std::int64_t delta = takt::between(std::exchange(last_, now), now).count();
    const bool is_told = is_switched ? threshold_.on_clock_change
                                     : (threshold_.min_forward.nanoseconds != 0 &&
                                        delta >= threshold_.min_forward.nanoseconds) ||
                                           (threshold_.min_backward.nanoseconds != 0 &&
                                            delta <= threshold_.min_backward.nanoseconds);
    if (!is_told) return;
    {
      const std::lock_guard lock(mutex_);
      if (!untold_) untold_ = {RCL_ROS_TIME_NO_CHANGE, {0}};
      untold_->delta.nanoseconds += delta;
      if (is_switched) {
        untold_->clock_change =
            clock_->simulates() ? RCL_ROS_TIME_ACTIVATED : RCL_ROS_TIME_DEACTIVATED;
      }
    }
    wake();
  }
  void wake() noexcept {
    changes_.fetch_add(1);
    changes_.notify_all();
  }

  const std::shared_ptr<takt::SimulatedClock> clock_;
  const takt::detail::UserFunction<void()> pre_;
  const takt::detail::UserFunction<void(const rcl_time_jump_t&)> post_;
  const rcl_jump_threshold_t threshold_;
  takt::TimePoint last_;  // guarded by the clock's lock
  std::atomic<std::uint32_t> changes_{0};
  std::atomic<bool> is_ended_{false};
  takt::PiMutex mutex_;  // guards what follows
  std::optional<rcl_time_jump_t> untold_;
};

JumpHandler::JumpHandler(std::shared_ptr<takt::SimulatedClock> clock, pre_callback_t pre_callback,
                         post_callback_t post_callback, const rcl_jump_threshold_t& threshold)
    : watch_(std::make_shared<Watch>(std::move(clock), std::move(pre_callback),
                                     std::move(post_callback), threshold)),
      thread_([watch = watch_] { watch->run(); }) {
}
JumpHandler::~JumpHandler() {
  watch_->end();
  if (thread_.get_id() == std::this_thread::get_id()) {
    thread_.detach();  // it goes in its own callback
  } else {
    thread_.join();
  }
}

JumpHandler::SharedPtr Clock::create_jump_callback(JumpHandler::pre_callback_t pre_callback,
                                                   JumpHandler::post_callback_t post_callback,
                                                   const rcl_jump_threshold_t& threshold) {
  if (threshold.min_forward.nanoseconds < 0) {
    throw std::invalid_argument("invalid jump threshold: min_forward is negative");
  }
  if (threshold.min_backward.nanoseconds > 0) {
    throw std::invalid_argument("invalid jump threshold: min_backward is positive");
  }
  auto clock = simulated_;  // other clocks do not jump
  if (clock == nullptr) {
    clock = std::make_shared<takt::SimulatedClock>(takt::Clock::steady(), false);
  }
  return std::make_shared<JumpHandler>(std::move(clock), std::move(pre_callback),
                                       std::move(post_callback), threshold);
}

}  // namespace rclcpp
