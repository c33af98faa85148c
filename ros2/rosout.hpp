// Publishes log lines on /rosout.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ROSOUT_HPP_
#define TAKT_ROS2_ROSOUT_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/messages/rcl_interfaces/msg/log.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Publishes every line that this process logs on `/rosout`, as a publisher of the host, from the
/// thread `log`: a callback that logs does no more than before. Lines of nodes have their names,
/// others the host's. A process has one; a second takes its place.
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
