// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/clock.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "rclcpp/rate.hpp"
#include "rclcpp/utilities.hpp"

namespace rclcpp {
namespace {

/// Sleeps until simulated time has come, begins or ends, or the context is shut down.
class SimulatedSleep final : takt::SimulatedClock::Listener, takt::Wakeable {
 public:
  SimulatedSleep(takt::SimulatedClock& clock, Context& context) : clock_(clock), context_(context) {
    clock_.add(*this);
    context_.add_waiter(*this);
  }
  ~SimulatedSleep() {
    context_.remove_waiter(*this);
    clock_.remove(*this);
  }
  SimulatedSleep(const SimulatedSleep&) = delete;
  SimulatedSleep& operator=(const SimulatedSleep&) = delete;

  bool until(std::chrono::nanoseconds time) {
    for (;;) {
      const std::uint32_t seen = changes_.load();
      if (!context_.is_valid() || !clock_.simulates()) return false;
      if (clock_.now().time_since_epoch() >= time) return true;
      changes_.wait(seen);
    }
  }

 private:
  void time_set(bool) noexcept override { wake(); }
  void wake() noexcept override {
    changes_.fetch_add(1);
    changes_.notify_all();
  }

  takt::SimulatedClock& clock_;
  Context& context_;
  std::atomic<std::uint32_t> changes_{0};
};

const Context::SharedPtr& checked(const Context::SharedPtr& context) {
  if (context == nullptr || !context->is_valid()) {
    throw std::runtime_error("context cannot be slept with because it's invalid");
  }
  return context;
}

}  // namespace

Clock::Clock(rcl_clock_type_t type)
    : type_(type),
      simulated_(type == RCL_ROS_TIME
                     ? std::make_shared<takt::SimulatedClock>(takt::Clock::steady(), false)
                     : nullptr) {
}
Clock::Clock(std::shared_ptr<takt::SimulatedClock> simulated)
    : type_(RCL_ROS_TIME), simulated_(std::move(simulated)) {
}

bool Clock::ros_time_is_active() const {
  if (type_ != RCL_ROS_TIME) {
    throw std::invalid_argument("clock is not a ROS clock");
  }
  return simulated_ != nullptr && simulated_->simulates();
}

Time Clock::now() const {
  using std::chrono::nanoseconds;
  nanoseconds since_epoch;
  if (type_ == RCL_STEADY_TIME) {
    since_epoch = takt::Clock::steady().now().time_since_epoch();
  } else if (simulated_ != nullptr && simulated_->simulates()) {
    since_epoch = simulated_->now().time_since_epoch();
  } else {
    since_epoch = std::chrono::system_clock::now().time_since_epoch();
  }
  return Time(since_epoch.count(), type_);
}

takt::Clock& Clock::takt_clock() const {
  if (simulated_ != nullptr) return *simulated_;
  return takt::Clock::steady();
}

bool Clock::sleep_until(Time until, Context::SharedPtr context) {
  if (until.get_clock_type() != type_) {
    throw std::runtime_error("until's clock type does not match this clock's type");
  }
  checked(context);
  if (simulated_ != nullptr && simulated_->simulates()) {
    return SimulatedSleep(*simulated_, *context)
        .until(std::chrono::nanoseconds(until.nanoseconds()));
  }
  for (Time time = now(); time < until; time = now()) {  // again if the system's time was set
    if (!context->sleep_for((until - time).to_chrono())) return false;
    if (type_ == RCL_STEADY_TIME) break;
  }
  return true;
}
bool Clock::sleep_for(Duration duration, Context::SharedPtr context) {
  return sleep_until(now() + duration, std::move(context));
}

bool Clock::wait_until_started(Context::SharedPtr context) {
  return wait_until_started(Duration::max(), std::move(context));
}
bool Clock::wait_until_started(const Duration& timeout, Context::SharedPtr context,
                               const Duration& wait_tick) {
  checked(context);
  const auto begin = std::chrono::steady_clock::now();
  while (!started()) {
    const auto left = timeout.to_chrono() - (std::chrono::steady_clock::now() - begin);
    if (left <= std::chrono::nanoseconds::zero()) return false;
    if (!context->sleep_for(std::min<std::chrono::nanoseconds>(left, wait_tick.to_chrono()))) {
      return false;
    }
  }
  return true;
}

Rate::Rate(double hz, Clock::SharedPtr clock)
    : Rate(hz > 0 ? Duration::from_seconds(1 / hz)
                  : throw std::invalid_argument("rate must be greater than 0"),
           std::move(clock)) {
}
Rate::Rate(const Duration& period, Clock::SharedPtr clock)
    : clock_(std::move(clock)), period_(period), last_(clock_->now()) {
  if (period_.nanoseconds() <= 0) throw std::invalid_argument("period must be greater than 0");
}

bool Rate::sleep() {
  const Time now = clock_->now();
  Time next = last_ + period_;
  if (now < last_) next = now + period_;  // the clock was set back
  last_ += period_;
  if (next <= now) {
    if (now > next + period_) last_ = now;  // a whole period was missed: a new phase
    return false;
  }
  clock_->sleep_for(next - now);
  return true;
}

}  // namespace rclcpp
