// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/timer.hpp"

namespace rclcpp {

void TimerBase::start(takt::Node& node, std::chrono::nanoseconds period, const std::string& name,
                      std::function<void(TimerBase&)> call,
                      std::shared_ptr<takt::CallbackGroup> group, bool autostart) {
  // Takt's timer owns the callback: so a callback that drops its own timer may go on.
  auto shared = std::make_shared<std::function<void(TimerBase&)>>(std::move(call));
  run_ = [this, shared] { (*shared)(*this); };
  const auto run = [this, shared] { (*shared)(*this); };
  if (clock_->get_clock_type() == RCL_ROS_TIME) {
    timer_ = node.create_timer(name, period, run, std::move(group));
  } else {
    timer_ = node.create_wall_timer(name, period, run, std::move(group));
  }
  if (!autostart) timer_->cancel();
}

std::shared_ptr<void> TimerBase::call() {
  takt::Slot slot;
  return timer_->take(slot) ? std::make_shared<takt::Slot>(slot) : nullptr;
}

}  // namespace rclcpp
