// The services of a running container: loading, parameters, lifecycle.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
#define TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_

#include <memory>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/messages/composition_interfaces/srv/load_node.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

class Container;

/// Serves requests on the container's own node `/CONTAINER`, which has a single-threaded executor:
/// - `/CONTAINER/_container/load_node`, `unload_node` and `list_nodes`: ROS 2's
///   composition_interfaces. The LoadPolicy decides which libraries may be loaded. `plugin_name` is
///   the component class; `package_name` is ignored, because the component index has no packages.
///   Extra arguments, written as in the configuration file: `library`, `executor` (a name in the
///   container), `on_exception`, and `callback_group.GROUP.KEY` with a key of a callback group.
/// - `/CONTAINER/set_callback_parameters`: see SetCallbackParameters.
/// - for each component's node: ROS 2's parameter services, if enabled, and the lifecycle services
///   of a lifecycle node. In ROS 2's graph they belong to that node.
/// - for itself: the parameter services, so that `ros2 param list`, which asks every node, waits
///   for none.
/// Requests are served one after another: while a component is constructed or unloaded, others
/// wait. Thread safety: only the container uses it. Real-time: no; components run on other threads.
class ComponentManager {
 public:
  ComponentManager(Container& container, const std::shared_ptr<Node>& node, LoadPolicy policy,
                   bool serves_parameters);
  /// Serves a component's node for as long as the returned object lives.
  std::shared_ptr<void> serve(const std::shared_ptr<Node>& component);

 private:
  const std::shared_ptr<Node> node_;
  const bool serves_parameters_;
  std::vector<std::shared_ptr<Entity>> services_;
  std::shared_ptr<void> own_;
};

/// Reads a load_node request; `executors` are the executor names that it may use. Throws Error if
/// the policy forbids the library, and ConfigurationError with all other errors.
ComponentDescription describe(const composition_interfaces::srv::LoadNode::Request& request,
                              const std::vector<std::string>& executors, const LoadPolicy& policy);

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
