// The services of a running container: loading, parameters, lifecycle.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
#define TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/executors/executor.hpp"
#include "takt/messages/composition_interfaces/srv/load_node.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

class Container;

/// Serves requests on the container's own node `/CONTAINER`:
/// - `/CONTAINER/_container/load_node`, `unload_node` and `list_nodes`: ROS 2's
///   composition_interfaces. The LoadPolicy decides which libraries may be loaded. `plugin_name` is
///   the component class; `package_name` is ignored, because the component index has no packages.
///   Extra arguments, written as in the configuration file: `library`, `executor` (a name in the
///   container), `on_exception`, and `callback_group.GROUP.KEY` with a key of a callback group.
/// - `/CONTAINER/_container/get_structure`: see ContainerStructure.
/// - `/CONTAINER/set_callback_parameters`: see SetCallbackParameters.
/// - `/CONTAINER/get_statistics`: see GetStatistics.
/// - `/CONTAINER/trace`: see TraceContainer.
/// - for each component's node: ROS 2's parameter services, if enabled, and the lifecycle services
///   of a lifecycle node. In ROS 2's graph they belong to that node.
/// - for itself: the parameter services, so that `ros2 param list`, which asks every node, waits
///   for none.
/// For a program that makes its nodes itself: set_callback_parameters, get_statistics and trace.
///
/// A request that needs no code of a user is answered at once, on the thread `container`. All
/// others are served by the threads of the executor `requests`: setting parameters and changing the
/// state, one after another for each node; loading and unloading, one after another; changing
/// parameters of callbacks; statistics and structure. So a callback that does not return delays
/// requests to its own node. If such callbacks block all threads of `requests`, they delay all
/// these requests.
///
/// Thread safety: only the container uses it; `serve` from any thread.
/// Real-time: no; components run on other threads.
class ComponentManager {
 public:
  ComponentManager(Container& container, const std::shared_ptr<Node>& node, Executor& requests,
                   LoadPolicy policy, bool serves_parameters);
  /// For a program that makes its nodes itself.
  ComponentManager(Container& container, const std::shared_ptr<Node>& node, Executor& requests);
  /// Serves a component's node for as long as the returned object lives.
  std::shared_ptr<void> serve(const std::shared_ptr<Node>& component);
  /// Creates a callback group of the container's node for callbacks that may run code of users: the
  /// executor `requests` serves it, one callback at a time.
  std::shared_ptr<CallbackGroup> make_group(std::string name);

 private:
  void observe(Container& container);

  const std::shared_ptr<Node> node_;
  Executor& requests_;
  const bool serves_parameters_;
  std::atomic<std::uint64_t> served_{0};  // numbers the groups
  std::vector<std::shared_ptr<Entity>> services_;
  std::shared_ptr<void> own_;
};

/// Reads a load_node request; `executors` are the executor names that it may use. Throws Error if
/// the policy forbids the library, and ConfigurationError with all other errors.
ComponentDescription describe(const composition_interfaces::srv::LoadNode::Request& request,
                              const std::vector<std::string>& executors, const LoadPolicy& policy);

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_MANAGER_HPP_
