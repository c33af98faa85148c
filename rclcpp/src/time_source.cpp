// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/time_source.hpp"

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"

namespace rclcpp {

/// Sets the clocks whenever that of the node is set, under that one's lock.
class TimeSource::Link final : takt::SimulatedClock::Listener {
 public:
  Link() = default;
  ~Link() { leave(); }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  void follow(std::shared_ptr<takt::SimulatedClock> source) {
    leave();
    {
      const std::lock_guard lock(mutex_);
      source_ = source;
      set_all(*source);
    }
    source->add(*this);
    time_set(false);  // what came in between
  }
  void leave() noexcept {
    std::shared_ptr<takt::SimulatedClock> source;
    {
      const std::lock_guard lock(mutex_);
      source = std::exchange(source_, nullptr);
      if (source == nullptr) return;
      for (const auto& clock : clocks_) {
        if (clock != source) clock->simulate(false);
      }
    }
    source->remove(*this);
  }
  void add(std::shared_ptr<takt::SimulatedClock> clock) {
    const std::lock_guard lock(mutex_);
    if (source_ != nullptr) set(*source_, *clock);
    clocks_.push_back(std::move(clock));
  }
  void remove(const std::shared_ptr<takt::SimulatedClock>& clock) {
    const std::lock_guard lock(mutex_);
    if (std::erase(clocks_, clock) != 0 && source_ != nullptr && clock != source_) {
      clock->simulate(false);
    }
  }

 private:
  static void set(const takt::SimulatedClock& from, takt::SimulatedClock& to) noexcept {
    if (&from == &to) return;  // that of the node itself was attached
    to.simulate(from.simulates());
    if (from.simulates() && from.now() != takt::TimePoint{}) to.set(from.now());
  }
  void set_all(const takt::SimulatedClock& from) noexcept {
    for (const auto& clock : clocks_) set(from, *clock);
  }
  void time_set(bool) noexcept override {
    const std::lock_guard lock(mutex_);
    if (source_ != nullptr) set_all(*source_);
  }

  takt::PiMutex mutex_;  // guards all below; inside the lock of the source
  std::shared_ptr<takt::SimulatedClock> source_;
  std::vector<std::shared_ptr<takt::SimulatedClock>> clocks_;
};

TimeSource::TimeSource(const QoS&, bool) : link_(std::make_unique<Link>()) {
}
TimeSource::TimeSource(const std::shared_ptr<Node>& node, const QoS& qos, bool use_clock_thread)
    : TimeSource(qos, use_clock_thread) {
  attachNode(node);
}
TimeSource::~TimeSource() = default;

void TimeSource::attachNode(std::shared_ptr<Node> node) {
  attach(*node->get_clock());
}
void TimeSource::attachNode(node_interfaces::NodeBaseInterface::SharedPtr,
                            node_interfaces::NodeTopicsInterface::SharedPtr,
                            node_interfaces::NodeGraphInterface::SharedPtr,
                            node_interfaces::NodeServicesInterface::SharedPtr,
                            node_interfaces::NodeLoggingInterface::SharedPtr,
                            node_interfaces::NodeClockInterface::SharedPtr clock,
                            node_interfaces::NodeParametersInterface::SharedPtr) {
  attach(*clock->get_clock());
}
void TimeSource::attach(const Clock& clock) {
  link_->follow(clock.simulated());
}
void TimeSource::detachNode() {
  link_->leave();
}
void TimeSource::attachClock(Clock::SharedPtr clock) {
  if (clock->get_clock_type() != RCL_ROS_TIME) {
    throw std::invalid_argument("Cannot attach clock to a time source that's not a ROS clock");
  }
  link_->add(clock->simulated());
}
void TimeSource::detachClock(Clock::SharedPtr clock) {
  link_->remove(clock->simulated());
}

}  // namespace rclcpp
