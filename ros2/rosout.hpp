// Publishes log lines on /rosout.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ROSOUT_HPP_
#define TAKT_ROS2_ROSOUT_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/messages/rcl_interfaces/msg/log.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Publishes every line that this process logs on `/rosout`, with a publisher of the host, from the
/// thread `log`: logging takes no longer for a callback. A line has the name of its node, or else
/// that of the host. A process has one Rosout; a second one replaces the first.
/// Thread safety: as Node. Real-time: set-up only.
class Rosout {
 public:
  explicit Rosout(Node& host);
  ~Rosout();
  Rosout(const Rosout&) = delete;
  Rosout& operator=(const Rosout&) = delete;

 private:
  void publish(const LogLine& line) const;

  const std::string host_;  // as loggers are called in ROS 2: "ns.node"
  const std::shared_ptr<Publisher<rcl_interfaces::msg::Log>> publisher_;
};

}  // namespace takt

#endif  // TAKT_ROS2_ROSOUT_HPP_
