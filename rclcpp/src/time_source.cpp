// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/time_source.hpp"

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "takt/nodes/node.hpp"

namespace rclcpp {

/// Attached clocks follow the time source of the node, never each other: two TimeSources may attach
/// each other's clocks.
class TimeSource::Link {
 public:
  using ClockPtr = std::shared_ptr<takt::SimulatedClock>;
  Link() = default;
  ~Link() { leave(); }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  void follow(node_interfaces::NodeBaseInterface::SharedPtr base) {
    leave();
    auto switched =
        base->takt_node()->add_post_set_parameters_callback([this](const takt::Parameters& values) {
          if (values.contains(takt::kUseSimTime)) look();
        });
    {
      const std::lock_guard lock(mutex_);
      base_ = std::move(base);
      switched_.swap(switched);
    }
    look();
  }
  void leave() noexcept {
    // Both are destroyed after the unlock: their destructors wait for running callbacks.
    takt::PostSetParametersHandle switched;
    node_interfaces::NodeBaseInterface::SharedPtr base;
    const std::lock_guard lock(mutex_);
    switched.swap(switched_);
    if (base_ == nullptr) return;
    for (const ClockPtr& clock : clocks_) release(clock);
    simulates_ = false;
    base.swap(base_);
  }
  void add(ClockPtr clock) {
    const std::lock_guard lock(mutex_);
    if (base_ != nullptr) set(clock);
    clocks_.push_back(std::move(clock));
  }
  void remove(const ClockPtr& clock) noexcept {
    const std::lock_guard lock(mutex_);
    if (std::erase(clocks_, clock) != 0 && base_ != nullptr) release(clock);
  }

 private:
  // Call with the mutex held and a node attached, as all functions below except look().
  ClockPtr own() const noexcept { return base_->takt_node()->clock().as_simulated(); }
  void release(const ClockPtr& clock) const noexcept {
    if (clock == own()) return;  // the node sets its own clock
    if (simulates_) base_->time_source()->leave(*clock);
    clock->simulate(false);
  }
  void set(const ClockPtr& clock) const {
    if (!simulates_ || clock == own()) return release(clock);
    clock->simulate(true);
    base_->time_source()->follow(clock);
  }
  void look() {
    const std::lock_guard lock(mutex_);
    if (base_ == nullptr) return;
    const ClockPtr of_node = own();
    const bool simulates =
        of_node != nullptr && of_node->simulates() && base_->time_source() != nullptr;
    if (simulates == simulates_) return;
    if (simulates_) {
      for (const ClockPtr& clock : clocks_) release(clock);
    }
    simulates_ = simulates;
    if (simulates_) {
      for (const ClockPtr& clock : clocks_) set(clock);
    }
  }

  std::mutex mutex_;  // guards all below
  node_interfaces::NodeBaseInterface::SharedPtr base_;
  takt::PostSetParametersHandle switched_;
  bool simulates_ = false;  // whether the node and the clocks use simulated time
  std::vector<ClockPtr> clocks_;
};

TimeSource::TimeSource(const QoS&, bool) : link_(std::make_unique<Link>()) {
}
TimeSource::TimeSource(const std::shared_ptr<Node>& node, const QoS& qos, bool use_clock_thread)
    : TimeSource(qos, use_clock_thread) {
  attachNode(node);
}
TimeSource::~TimeSource() = default;

void TimeSource::attachNode(std::shared_ptr<Node> node) {
  link_->follow(node->get_node_base_interface());
}
void TimeSource::attachNode(node_interfaces::NodeBaseInterface::SharedPtr base,
                            node_interfaces::NodeTopicsInterface::SharedPtr,
                            node_interfaces::NodeGraphInterface::SharedPtr,
                            node_interfaces::NodeServicesInterface::SharedPtr,
                            node_interfaces::NodeLoggingInterface::SharedPtr,
                            node_interfaces::NodeClockInterface::SharedPtr,
                            node_interfaces::NodeParametersInterface::SharedPtr) {
  link_->follow(std::move(base));
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
