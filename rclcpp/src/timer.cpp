// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/timer.hpp"

namespace rclcpp {

TimerBase::TimerBase(Clock::SharedPtr clock, std::chrono::nanoseconds period,
                     TimerCallbackType call, bool autostart)
    : clock_(std::move(clock)),
      period_(period),
      call_(std::make_shared<const TimerCallbackType>(std::move(call))),
      autostart_(autostart) {
  if (clock_ == nullptr) throw std::invalid_argument("clock cannot be null");
}

void TimerBase::add_to(takt::Node& node, const std::string& name,
                       std::shared_ptr<takt::CallbackGroup> group) {
  if (timer_ != nullptr) throw std::runtime_error("timer has been added to a node before");
  // Takt's timer has one of its own, for the callback: so it may drop this one, and still use both.
  const std::shared_ptr<TimerBase> called(new TimerBase(*this));
  const auto run = [called] { called->execute_callback(); };
  // Created without autostart: `called` must have its timer first.
  if (clock_->get_clock_type() == RCL_ROS_TIME) {
    timer_ = node.create_timer(name, period_, run, std::move(group), false);
  } else {
    timer_ = node.create_wall_timer(name, period_, run, std::move(group), false);
  }
  called->timer_ = std::shared_ptr<takt::Timer>(std::shared_ptr<void>(), timer_.get());
  if (autostart_) timer_->reset();
}

std::shared_ptr<void> TimerBase::call() {
  takt::Slot slot;
  return entity()->take(slot) ? std::make_shared<takt::Slot>(slot) : nullptr;
}

}  // namespace rclcpp
