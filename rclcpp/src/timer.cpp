// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/timer.hpp"

namespace rclcpp {

/// Owned by Takt's timer: the user's callback and the TimerBase passed to it. So a callback that
/// drops its own timer may still use both.
struct TimerBase::Called : TimerBase {
  Called(Clock::SharedPtr clock, std::function<void(TimerBase&)> function)
      : TimerBase(std::move(clock)), call(std::move(function)) {}
  const std::function<void(TimerBase&)> call;
};

void TimerBase::start(takt::Node& node, std::chrono::nanoseconds period, const std::string& name,
                      std::function<void(TimerBase&)> call,
                      std::shared_ptr<takt::CallbackGroup> group, bool autostart) {
  const auto called = std::make_shared<Called>(clock_, std::move(call));
  run_ = [this, called] { called->call(*this); };
  called->run_ = [own = called.get()] { own->call(*own); };
  const auto run = [called] { called->call(*called); };
  // Created without autostart: `called` must have its timer first.
  if (clock_->get_clock_type() == RCL_ROS_TIME) {
    timer_ = node.create_timer(name, period, run, std::move(group), false);
  } else {
    timer_ = node.create_wall_timer(name, period, run, std::move(group), false);
  }
  called->timer_ = std::shared_ptr<takt::Timer>(std::shared_ptr<void>(), timer_.get());
  if (autostart) timer_->reset();
}

std::shared_ptr<void> TimerBase::call() {
  takt::Slot slot;
  return timer_->take(slot) ? std::make_shared<takt::Slot>(slot) : nullptr;
}

}  // namespace rclcpp
