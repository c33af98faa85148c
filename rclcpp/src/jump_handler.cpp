// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "takt/base/pi_mutex.hpp"
#include "takt/entities/callback_list.hpp"

#include "rclcpp/clock.hpp"

namespace rclcpp {

/// Reports jumps of a simulated clock on a thread of its own, step by step:
/// 1. Setting the clock calls time_set under the clock's lock; time_set compares the new time with
///    the last one.
/// 2. A jump beyond the threshold is added to `untold_`, and the thread is woken.
/// 3. The thread takes `untold_` and calls the callbacks.
class JumpHandler::Watch final : takt::SimulatedClock::Listener {
 public:
  Watch(std::shared_ptr<takt::SimulatedClock> clock, pre_callback_t pre, post_callback_t post,
        const rcl_jump_threshold_t& threshold)
      : clock_(std::move(clock)),
        call_([pre = std::move(pre), post = std::move(post)](const rcl_time_jump_t& jump) {
          if (pre) pre();
          if (post) post(jump);
        }),
        threshold_(threshold),
        last_(clock_->read()) {
    clock_->add(*this);
  }
  ~Watch() { clock_->remove(*this); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  void run() {
    for (;;) {
      const std::uint32_t seen = changes_.load();
      if (call_.is_removed()) return;
      std::optional<rcl_time_jump_t> jump;
      {
        const std::lock_guard lock(mutex_);
        std::swap(jump, untold_);
      }
      if (!jump) {
        changes_.wait(seen);  // Waits for work, as a thread of our own
        continue;
      }
      if (!call_.call([&](const auto& function) { function(*jump); })) return;
    }
  }
  /// False: a callback may wait for the caller, so the thread cannot be joined.
  bool end() noexcept {
    call_.remove();
    wake();
    return call_.is_gone();
  }

 private:
  void time_set(bool is_switched) noexcept override {
    const takt::SourceTime now = clock_->read();
    // A switch between real and simulated time has no duration: its delta is 0.
    const std::int64_t delta =
        std::exchange(last_, now).until(now).value_or(takt::Nanoseconds::zero()).count();
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
  takt::detail::Removable<void(const rcl_time_jump_t&)> call_;
  const rcl_jump_threshold_t threshold_;
  takt::SourceTime last_;  // guarded by the clock's lock
  std::atomic<std::uint32_t> changes_{0};
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
  if (watch_->end()) {
    thread_.join();
  } else {
    thread_.detach();
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
