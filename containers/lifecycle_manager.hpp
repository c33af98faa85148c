// Brings the lifecycle nodes of a system up together, and down again.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LIFECYCLE_MANAGER_HPP_
#define TAKT_CONTAINERS_LIFECYCLE_MANAGER_HPP_

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/nodes/node.hpp"

namespace takt {

/// That a node's process lives, and the node's state: what a manager watches, whatever process it
/// is in.
struct Heartbeat {
  std::string node;        // with its namespace
  std::uint8_t state = 0;  // a LifecycleState
};
TAKT_MESSAGE(Heartbeat, "takt_interfaces/msg/Heartbeat", node, state);

/// Tells the state of the lifecycle nodes of a process, three times in the time that a manager
/// waits.
/// Thread safety: nodes come and go from any thread.
/// Real-time: no; on the container's own thread.
class HeartbeatSender {
 public:
  HeartbeatSender(Node& host, Nanoseconds heartbeat);
  /// As long as the result lives.
  std::shared_ptr<void> tell(const std::shared_ptr<LifecycleNode>& node);

 private:
  void send();

  const std::shared_ptr<Publisher<Heartbeat>> publisher_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<LifecycleNode>> nodes_;
  std::shared_ptr<Timer> timer_;
};

/// The rules, which hold whoever changes a state (the manager itself asks by ROS 2's change_state,
/// so nodes may be in any process):
/// 1. Up: in the order of `bring_up` each node is configured and activated; the next one comes when
///    it is active, or has failed. A node comes up only while all that it depends on are active.
/// 2. While it is active and one that it depends on is not, it is deactivated, and activated when
///    that is active again (`on_loss: deactivate_dependents`).
/// 3. A node of which nothing was heard for `heartbeat` is lost, until it is heard of again: then
///    it comes up from wherever it is. `on_loss: shutdown` takes all down, for good; `report` logs.
/// 4. A node that has refused or failed a transition is left alone, and so is one that was up and
///    was deactivated by somebody else.
///    One that has not answered for 30 s is asked again, if its heartbeats say that it has to be.
/// 5. Down: in reverse order each node is deactivated, cleaned up and shut down.
///
/// Thread safety: its callbacks run on the host's executor; the rest from any thread.
/// Real-time: no.
class LifecycleManager {
 public:
  LifecycleManager(Node& host, const LifecycleDescription& description);
  ~LifecycleManager();
  LifecycleManager(const LifecycleManager&) = delete;
  LifecycleManager& operator=(const LifecycleManager&) = delete;

  void bring_up();
  /// Returns when all that can be reached are finalized, or the time is up: then with the names of
  /// those that are not.
  std::vector<std::string> shut_down(Nanoseconds limit);
  /// All that come up are active. For tests.
  bool is_up() const;

 private:
  struct Managed;
  enum class Target { none, up, down };

  void heard(const Heartbeat& heartbeat);
  void look_for_lost();
  void step();
  void step_up(Managed& node);
  void step_down(Managed& node);
  void ask(Managed& node, std::string_view transition);
  const Managed& find(const std::string& name) const;
  bool may_be_active(const Managed& node) const;

  const LifecycleDescription description_;
  const Clock& clock_;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  Target target_ = Target::none;
  std::vector<std::unique_ptr<Managed>> nodes_;
  std::shared_ptr<Subscription<Heartbeat>> heartbeats_;
  std::shared_ptr<Timer> watch_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_LIFECYCLE_MANAGER_HPP_
