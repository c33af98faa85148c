// Sets a simulated clock from the topic /clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_TIME_SOURCE_HPP_
#define TAKT_ROS2_TIME_SOURCE_HPP_

#include <memory>

#include "takt/base/simulated_clock.hpp"
#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/nodes/node.hpp"

namespace takt {

/// Follows `/clock`, by a subscription of the host, which outlives it as the clock does. The host's
/// own clock must be a real one.
/// Thread safety: as Node. Real-time: as SimulatedClock::set.
class TimeSource {
 public:
  TimeSource(Node& host, SimulatedClock& clock);

 private:
  const std::shared_ptr<Subscription<rosgraph_msgs::msg::Clock>> subscription_;
};

}  // namespace takt

#endif  // TAKT_ROS2_TIME_SOURCE_HPP_
