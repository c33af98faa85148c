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

/// A status for the container, each executor, each callback and each chain, once a second while
/// somebody subscribes, as a publisher of the host, in a group that may run code of users: the
/// destructor of a node whose last pointer it holds. WARN: deadlines were missed or messages
/// dropped in the last second. While nobody subscribes, nothing runs or wakes up. Thread safety: as
/// Node. Real-time: no.
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
  GetStatistics::Response before_;  // when it last looked
  const std::shared_ptr<Timer> timer_;
};

/// What it publishes of two answers; `host` begins each name.
diagnostic_msgs::msg::DiagnosticArray diagnostics_of(const std::string& host,
                                                     const GetStatistics::Response& before,
                                                     const GetStatistics::Response& now);

}  // namespace takt

#endif  // TAKT_CONTAINERS_DIAGNOSTICS_HPP_
