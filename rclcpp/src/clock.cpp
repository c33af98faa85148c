// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/clock.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/programs/simulated_program.hpp"

#include "rclcpp/rate.hpp"
#include "rclcpp/utilities.hpp"
#include "rcutils/time.h"

namespace rclcpp {
namespace {

/// A sleep by a clock. It ends early when simulated time begins or ends, or the context is shut
/// down.
class Sleep final : takt::SimulatedClock::Listener, takt::Wakeable {
 public:
  Sleep(const Clock& clock, Context& context)
      : clock_(clock), context_(context), begin_(clock.read()) {
    takt::programs::refuse("sleeps by a Clock or a Rate");
    if (clock_.simulated() != nullptr) clock_.simulated()->add(*this);
    context_.add_waiter(*this);
  }
  ~Sleep() {
    context_.remove_waiter(*this);
    if (clock_.simulated() != nullptr) clock_.simulated()->remove(*this);
  }
  Sleep(const Sleep&) = delete;
  Sleep& operator=(const Sleep&) = delete;

  bool for_duration(std::chrono::nanoseconds duration) { return until(begin_.after(duration)); }
  /// Sleeps until this time of the source, simulated or real, that the clock had at construction.
  bool until_time(const Time& time) {
    return until({std::chrono::nanoseconds(time.nanoseconds()), begin_.source()});
  }

 private:
  bool until(const takt::SourceTime& time) {
    for (;;) {
      if (!context_.is_valid()) return false;
      const auto left = clock_.read().until(time);
      if (!left) return false;
      if (*left <= std::chrono::nanoseconds::zero()) return true;
      const bool is_woken =
          clock_.simulated() != nullptr && takt::SimulatedClock::is_simulated(time.source());
      // System time may be set during the wait: the loop reads the clock again.
      backend_->wait(0, is_woken ? takt::kNever : takt::later(takt::Clock::steady().now(), *left));
    }
  }
  void time_set(bool) noexcept override { wake(); }
  void wake() noexcept override { backend_->post(); }

  const Clock& clock_;
  Context& context_;
  const takt::SourceTime begin_;
  const std::unique_ptr<takt::WaitBackend> backend_ =
      takt::make_wait_backend(takt::kAutoWait, takt::Clock::steady(), 1, false);
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

std::chrono::system_clock::time_point detail::system_now() {
  takt::Clock& steady = takt::Clock::steady();
  if (steady.as_manual() == nullptr) return std::chrono::system_clock::now();
  return std::chrono::system_clock::time_point(steady.now().time_since_epoch());
}

takt::SourceTime Clock::read() const {
  const auto of_system = [] {
    return std::chrono::nanoseconds(detail::system_now().time_since_epoch());
  };
  if (simulated_ != nullptr) return simulated_->read(of_system);
  return {type_ == RCL_STEADY_TIME ? takt::Clock::steady().now().time_since_epoch() : of_system(),
          0};
}
Time Clock::now() const {
  return Time(read().since_epoch().count(), type_);
}

takt::Clock& Clock::takt_clock() const {
  if (simulated_ != nullptr) return *simulated_;
  return takt::Clock::steady();
}

bool Clock::sleep_until(Time until, Context::SharedPtr context) {
  if (until.get_clock_type() != type_) {
    throw std::runtime_error("until's clock type does not match this clock's type");
  }
  return Sleep(*this, *checked(context)).until_time(until);
}
bool Clock::sleep_for(Duration duration, Context::SharedPtr context) {
  return Sleep(*this, *checked(context)).for_duration(duration.to_chrono());
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
    : clock_(std::move(clock)), period_(period), last_(clock_->read()) {
  if (period_.nanoseconds() <= 0) throw std::invalid_argument("period must be greater than 0");
}

bool Rate::sleep() {
  const takt::SourceTime now = clock_->read();
  auto since = last_.until(now);
  if (!since || *since < std::chrono::nanoseconds::zero()) {  // another time source, or set back
    since = std::chrono::nanoseconds::zero();
    last_ = now;
  }
  last_ = last_.after(period());
  const auto left = period() - *since;
  if (left <= std::chrono::nanoseconds::zero()) {
    if (left < -period()) last_ = now;  // a whole period was missed: start a new phase
    return false;
  }
  clock_->sleep_for(left);
  return true;
}

}  // namespace rclcpp

namespace {
rcutils_ret_t set_to_now(rcutils_time_point_value_t* time, rcl_clock_type_t type) {
  if (time == nullptr) return RCUTILS_RET_INVALID_ARGUMENT;
  *time = rclcpp::Clock(type).now().nanoseconds();
  return RCUTILS_RET_OK;
}
}  // namespace
rcutils_ret_t rcutils_system_time_now(rcutils_time_point_value_t* now) {
  return set_to_now(now, RCL_SYSTEM_TIME);
}
rcutils_ret_t rcutils_steady_time_now(rcutils_time_point_value_t* now) {
  return set_to_now(now, RCL_STEADY_TIME);
}
