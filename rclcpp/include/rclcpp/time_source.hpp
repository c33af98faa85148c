// Lets clocks that a program has made follow the time of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TIME_SOURCE_HPP_
#define RCLCPP__TIME_SOURCE_HPP_

#include <memory>

#include "rclcpp/node.hpp"

namespace rclcpp {

/// Attached clocks use simulated time while the node does, from the same /clock. The QoS of /clock
/// and its thread are those of the context: see docs/reference/rclcpp.md. Thread safety: every
/// method from any thread. Real-time: no.
class TimeSource {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS_NOT_COPYABLE(TimeSource)
  explicit TimeSource(const QoS& qos = ClockQoS(), bool use_clock_thread = true);
  explicit TimeSource(const std::shared_ptr<Node>& node, const QoS& qos = ClockQoS(),
                      bool use_clock_thread = true);
  ~TimeSource();

  void attachNode(std::shared_ptr<Node> node);
  void attachNode(node_interfaces::NodeBaseInterface::SharedPtr base,
                  node_interfaces::NodeTopicsInterface::SharedPtr,
                  node_interfaces::NodeGraphInterface::SharedPtr,
                  node_interfaces::NodeServicesInterface::SharedPtr,
                  node_interfaces::NodeLoggingInterface::SharedPtr,
                  node_interfaces::NodeClockInterface::SharedPtr,
                  node_interfaces::NodeParametersInterface::SharedPtr);
  /// Attached clocks return to system time.
  void detachNode();
  /// Throws std::invalid_argument when the clock is not of type RCL_ROS_TIME.
  void attachClock(Clock::SharedPtr clock);
  void detachClock(Clock::SharedPtr clock);
  bool get_use_clock_thread() { return true; }
  bool clock_thread_is_joinable() { return true; }

 private:
  class Link;
  const std::unique_ptr<Link> link_;
};

}  // namespace rclcpp

#endif  // RCLCPP__TIME_SOURCE_HPP_
