// The lifecycle nodes of a container. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_LIFECYCLE_HPP_
#define TAKT_CONTAINERS_CONTAINER_LIFECYCLE_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_executors.hpp"
#include "takt/containers/lifecycle_manager.hpp"
#include "takt/containers/unloading_threads.hpp"

namespace TAKT_INTERNAL takt {

/// Sends the heartbeats of the container's lifecycle nodes, and manages the lifecycle nodes of the
/// system, if the file has `lifecycle`.
/// Thread safety: `add` from any thread; the rest from the control thread. Real-time: no.
class ContainerLifecycle {
 public:
  ContainerLifecycle(ContainerSetting& setting, const ComponentList& components)
      : setting_(setting), components_(components) {}

  void make(ContainerExecutors& executors);
  /// nullptr: the file has no `lifecycle`.
  const std::shared_ptr<Node>& node() const noexcept { return node_; }
  /// Sends heartbeats for the component if its node is a lifecycle node.
  void add(Loaded& loaded);

  void bring_up();
  std::vector<std::string> unconfigured() const;
  /// Those that have been active.
  std::vector<std::string> active() const;
  void shut_down();
  /// Brings down the lifecycle nodes that no manager has shut down: `bring_up` does not list them,
  /// or the manager could not reach them. In reverse order of construction.
  void bring_down_rest(UnloadingThreads& threads);

 private:
  ContainerSetting& setting_;
  const ComponentList& components_;
  std::shared_ptr<Node> node_;
  std::unique_ptr<HeartbeatSender> heartbeats_;
  std::unique_ptr<LifecycleManager> manager_;  // only in one process of the system
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_LIFECYCLE_HPP_
