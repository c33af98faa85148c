// Publishes how a container does as ROS 2's /diagnostics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_DIAGNOSTICS_HPP_
#define TAKT_CONTAINERS_DIAGNOSTICS_HPP_

#include <memory>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/containers/get_statistics.hpp"
#include "takt/messages/diagnostic_msgs/msg/diagnostic_array.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_INTERNAL takt {

class Container;

inline constexpr const char* kDiagnosticsTopic = "/diagnostics";

/// Publishes a status of the container, of each executor, callback and chain once a second while
/// somebody subscribes; the publisher belongs to the host. The timer's group may run code of users:
/// it may drop the last pointer to a node, and so run its destructor. WARN: deadlines were missed
/// or messages dropped in the last second. While nobody subscribes, nothing runs or wakes up.
/// Thread safety: as Node. Real-time: no.
class Diagnostics final : private EndpointEvents::Listener {
 public:
  Diagnostics(const Container& container, Node& host, std::shared_ptr<CallbackGroup> group);
  ~Diagnostics();
  Diagnostics(const Diagnostics&) = delete;
  Diagnostics& operator=(const Diagnostics&) = delete;

 private:
  void happened() noexcept override;
  bool is_wanted() const noexcept;
  void look();

  const Container& container_;
  const Node& host_;
  const std::shared_ptr<Publisher<diagnostic_msgs::msg::DiagnosticArray>> publisher_;
  GetStatistics::Response before_;  // at the timer's last release
  const std::shared_ptr<Timer> timer_;
};

/// The message for the interval between two answers; each name in it begins with `host`.
diagnostic_msgs::msg::DiagnosticArray diagnostics_of(const std::string& host,
                                                     const GetStatistics::Response& before,
                                                     const GetStatistics::Response& now);

}  // namespace takt

#endif  // TAKT_CONTAINERS_DIAGNOSTICS_HPP_
