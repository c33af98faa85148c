// Sets simulated clocks from the topic /clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_TIME_SOURCE_HPP_
#define TAKT_ROS2_TIME_SOURCE_HPP_

#include <memory>
#include <optional>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Subscribes to `/clock` while a clock needs it: the clock of a node with this time source and a
/// true `use_sim_time`. Several nodes may share a time source.
/// Thread safety: every method from any thread.
/// Real-time: no; clocks are set on the host's executor, as SimulatedClock::set.
class TimeSource final : public SimulatedClock::Source {
 public:
  /// The node that gets the subscription to `/clock`, held by weak_ptr; nullptr: no node. Without a
  /// host, simulated time stands still.
  void set_host(const std::shared_ptr<Node>& host);

  /// Calls are counted: leave() ends following a clock after as many calls as follow() had.
  void follow(const std::shared_ptr<SimulatedClock>& clock) override;
  void leave(const SimulatedClock& clock) noexcept override;

 private:
  using ClockMessage = rosgraph_msgs::msg::Clock;

  void subscribe();
  void set(TimePoint now) noexcept;

  RankedMutex<LockRank::time_source> mutex_;  // guards all below
  std::weak_ptr<Node> host_;
  struct Followed {
    std::weak_ptr<SimulatedClock> clock;
    int count = 0;
  };
  std::vector<Followed> clocks_;
  std::optional<TimePoint> now_;
  std::shared_ptr<Subscription<ClockMessage>> subscription_;
};

}  // namespace takt

#endif  // TAKT_ROS2_TIME_SOURCE_HPP_
