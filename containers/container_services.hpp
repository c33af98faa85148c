// What a container serves to others. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_SERVICES_HPP_
#define TAKT_CONTAINERS_CONTAINER_SERVICES_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/containers/component_manager.hpp"
#include "takt/containers/container_lifecycle.hpp"
#include "takt/containers/container_watching.hpp"
#include "takt/containers/diagnostics.hpp"
#include "takt/ros2/rosout.hpp"

namespace TAKT_INTERNAL takt {

/// The container's own node, and the work of its threads: requests, exceptions of callbacks, and
/// mode switches.
/// Thread safety: from any thread, after make(). Real-time: no.
class ContainerServices {
 public:
  ContainerServices(const ContainerSetting& setting, ComponentList& components,
                    ContainerExecutors& executors, const ContainerLifecycle& lifecycle,
                    ContainerWatch& watch)
      : setting_(setting),
        components_(components),
        executors_(executors),
        lifecycle_(lifecycle),
        watch_(watch) {}
  ~ContainerServices();

  void make(Container& container);
  /// Serves requests to a component from now on.
  void serve(Loaded& loaded);
  /// Handles the exception on the thread of the callback. Returns whether its executor continues.
  bool handle(const FailedCallback& failed);
  /// Switches until the requested mode is in force.
  void switch_mode();

 private:
  void displace_failed();

  const ContainerSetting& setting_;
  ComponentList& components_;
  ContainerExecutors& executors_;
  const ContainerLifecycle& lifecycle_;
  ContainerWatch& watch_;
  std::shared_ptr<Node> node_;  // nullptr: nothing needs it
  std::unique_ptr<ComponentManager> manager_;
  std::unique_ptr<Rosout> rosout_;
  std::unique_ptr<Diagnostics> diagnostics_;
  std::shared_ptr<void> of_lifecycle_node_;
  std::shared_ptr<GuardCondition> failed_;       // a failed component must leave its executors
  std::shared_ptr<GuardCondition> mode_wanted_;  // the requested mode is not in force
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_SERVICES_HPP_
