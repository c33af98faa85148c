// Which executor of a container runs what. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_EXECUTORS_HPP_
#define TAKT_CONTAINERS_CONTAINER_EXECUTORS_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/component_list.hpp"
#include "takt/containers/running_executors.hpp"
#include "takt/executors/watchdog.hpp"

namespace TAKT_INTERNAL takt {

inline constexpr const char* kDefaultExecutor = "default";

/// Makes the executors of the file, adds components to them, and starts each executor with its
/// first callback.
/// Thread safety: make_all() first; then every method from any thread. Real-time: no.
class ContainerExecutors final : private NodeListener {
 public:
  ContainerExecutors(ContainerSetting& setting, ComponentList& components,
                     RunningExecutors& running)
      : setting_(setting), components_(components), running_(running) {}
  ~ContainerExecutors();

  void make_all();
  /// For the container's own callbacks: they allocate memory, so they run apart from components.
  Executor& make_own(const char* name, std::size_t threads = 1);
  /// The executors of the file, and `default` if a component or a group needs it.
  std::vector<ExecutorDescription> described() const;

  /// Sets the component's executor if it names none. Throws Error if it names one that does not
  /// exist or cannot run it.
  void choose(ComponentDescription& component) const;
  /// The name of the executor that runs a group. `loaded` need not be in the list yet.
  std::string name_for(const Loaded& loaded, const CallbackGroup& group) const {
    return name_for(loaded.executor_of(group));
  }
  std::string name_for(const Node& node, const CallbackGroup& group) const {
    return name_for(components_.executor_of(node, group));
  }
  /// The executor with this name; empty: `default`. The reader or choose() has checked the name.
  RunningExecutor& find(const std::string& name) const;

  const RunningExecutors& running() const noexcept { return running_; }

  void place(const Loaded& loaded);
  /// Undoes place(), and waits for running callbacks. If another thread is doing so, waits for that
  /// thread; but not if that thread waits for the caller, which may be in a callback of the node.
  void displace(Loaded& loaded);
  /// Stops listening to new entities of the component's node.
  void ignore(const Loaded& loaded) { loaded.node()->remove_listener(*this); }
  /// Throws Error if displace() would, before anything has changed.
  void check_removable(const Loaded& loaded) const;
  /// Starts the executors of the component's callbacks.
  void begin(const Loaded& loaded);

 private:
  void make(const ExecutorDescription& executor);
  std::string name_for(const std::string& described) const;
  bool is_placed_alone(const CallbackGroup& group) const;
  void begin(const Loaded& loaded, const CallbackGroup& group);
  void begin(RunningExecutor& running);
  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node& /*node*/, const std::shared_ptr<CallbackGroup>& /*group*/) override {}
  void parameters_changed(Node& /*node*/) override {}

  ContainerSetting& setting_;
  ComponentList& components_;
  RunningExecutors& running_;
  std::shared_ptr<Watchdog> watchdog_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_EXECUTORS_HPP_
