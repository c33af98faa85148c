// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/time_source.hpp"

#include "takt/ros2/wire_time.hpp"

namespace takt {

TimeSource::TimeSource(Node& host, SimulatedClock& clock)
    : subscription_(host.create_subscription<rosgraph_msgs::msg::Clock>(
          "/clock", *qos_profile("clock"), [&clock](const rosgraph_msgs::msg::Clock& message) {
            clock.set(TimePoint(Nanoseconds(nanoseconds_of(message.clock))));
          })) {
}

}  // namespace takt
