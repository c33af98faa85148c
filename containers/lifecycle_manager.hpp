// Brings the lifecycle nodes of a system up in order, monitors them, and shuts them down.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LIFECYCLE_MANAGER_HPP_
#define TAKT_CONTAINERS_LIFECYCLE_MANAGER_HPP_

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// Sent periodically by the process of a lifecycle node: shows that the process is alive, and the
/// node's state.
struct Heartbeat {
  std::string node;        // with its namespace
  std::uint8_t state = 0;  // a LifecycleState
};
TAKT_MESSAGE(Heartbeat, "takt_interfaces/msg/Heartbeat", node, state);

/// Publishes the state of the lifecycle nodes of a process, three times per `heartbeat`, so that
/// one lost message does not make a node lost. Thread safety: from any thread. Real-time: no; it
/// runs on the container's own thread.
class HeartbeatSender {
 public:
  HeartbeatSender(Node& host, Nanoseconds heartbeat);
  /// Includes a node for as long as the returned object lives.
  std::shared_ptr<void> add(const std::shared_ptr<LifecycleNode>& node);

 private:
  void send();

  const std::shared_ptr<Publisher<Heartbeat>> publisher_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<LifecycleNode>> nodes_;
  std::shared_ptr<Timer> timer_;
};

/// Manages lifecycle nodes of any process by ROS 2's service change_state. It reacts to the state
/// in their heartbeats, so the rules also hold when another client changes a state:
/// 1. Up: it configures and activates the nodes in the order of `bring_up`, each after the one
///    before it is active, and only while all nodes that it depends on are active. At a node that
///    fails, or that nobody has, the bring-up stops; one that comes later goes on from there.
/// 2. If a node that an active node depends on becomes inactive, the dependent node is deactivated,
///    and activated again afterwards (`on_loss: deactivate_dependents`).
/// 3. A node without heartbeats for the time `heartbeat` is lost. When its heartbeats return, it is
///    brought up from its present state. With `on_loss: shutdown` the manager shuts down all nodes
///    for good; with `report` it only logs.
/// 4. The manager leaves a node alone that refused or failed a transition, or that another client
///    deactivated. If a node has not answered a request for 30 s, and its heartbeats show that the
///    transition is still needed, the manager repeats the request.
/// 5. Down: in reverse order it deactivates, cleans up and shuts down each node.
///
/// Thread safety: callbacks run on the host's executor; all functions from any thread.
/// Real-time: no.
class LifecycleManager {
 public:
  LifecycleManager(Node& host, const LifecycleDescription& description);
  ~LifecycleManager();
  LifecycleManager(const LifecycleManager&) = delete;
  LifecycleManager& operator=(const LifecycleManager&) = delete;

  void bring_up();
  /// Waits until all reachable nodes are finalized, or until `limit` has passed. Returns the names
  /// of the nodes that are not finalized.
  std::vector<std::string> shut_down(Nanoseconds limit);
  /// Why the bring-up has stopped; before shut_down().
  std::vector<std::string> failures() const;
  /// Whether all nodes are active. For tests.
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
