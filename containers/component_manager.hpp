// What a running container can be asked for.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
#define TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_

#include <memory>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/messages/composition_interfaces/srv/load_node.hpp"
#include "takt/nodes/node.hpp"

namespace takt {

class Container;

/// Answers, on the container's own node `/CONTAINER`, which is under an executor with one thread:
/// - `/CONTAINER/_container/load_node`, `unload_node` and `list_nodes`, ROS 2's
///   composition_interfaces. What is loaded, the container's LoadPolicy says. The plug-in's name is
///   the component's class; the package is not looked at, as the component index knows no packages.
///   Extra arguments, written as in the configuration
///   file: `library`, `executor` (a name in the container), `on_exception`, and
///   `callback_group.GROUP.KEY` with a key of a callback group.
/// - `/CONTAINER/set_callback_parameters`, see SetCallbackParameters.
/// - for each component's node ROS 2's parameter services, if they are wanted, and those of its
///   lifecycle, if it has one.
/// One is answered after the other: while a component is made, or waited for, the others wait.
/// Thread safety: for the container.
/// Real-time: no; the components have other threads.
class ComponentManager {
 public:
  ComponentManager(Container& container, const std::shared_ptr<Node>& node, LoadPolicy policy,
                   bool serves_parameters);
  /// The services of a component's node, as long as the result lives.
  std::shared_ptr<void> serve(const std::shared_ptr<Node>& component);

 private:
  const std::shared_ptr<Node> node_;
  const bool serves_parameters_;
  std::vector<std::shared_ptr<Entity>> services_;
};

/// What a request asks for. Throws Error when the policy does not allow it, else ConfigurationError
/// with all that is wrong; `executors`: the names that it may give.
ComponentDescription describe(const composition_interfaces::srv::LoadNode::Request& request,
                              const std::vector<std::string>& executors, const LoadPolicy& policy);

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
