// The components of a container. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_LIST_HPP_
#define TAKT_CONTAINERS_COMPONENT_LIST_HPP_

#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_setting.hpp"
#include "takt/containers/looks.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace TAKT_INTERNAL takt {

/// A component in its container.
struct Loaded {
  std::uint64_t id = 0;
  ComponentDescription description;
  std::unique_ptr<Component> component;
  std::shared_ptr<void> services, heartbeat;  // of this component, on the container's own node
  // Guarded by the list.
  bool is_leaving = false;
  bool has_failed = false;  // a callback threw: remove it from its executors

  enum class Displacement { none, under_way, done };
  std::atomic<Displacement> displacement{Displacement::none};
  std::once_flag completed;  // a second caller waits for the first

  LifecycleNode* lifecycle() const noexcept {
    return dynamic_cast<LifecycleNode*>(component->node.get());
  }
  const std::shared_ptr<Node>& node() const noexcept { return component->node; }
  /// The executor that the description gives this group; empty: the component's executor.
  std::string own_executor(const CallbackGroup& group) const {
    const auto found = description.callback_groups.find(group.name());
    return found != description.callback_groups.end() ? found->second.executor : "";
  }
  /// The executor of the group, or else of the component; empty: the description names none.
  std::string executor_of(const CallbackGroup& group) const {
    const std::string own = own_executor(group);
    return own.empty() ? description.executor : own;
  }
};

/// The components, and the plan of their callbacks. While its lock is held, no other lock is taken
/// and nothing is destroyed.
/// Thread safety: from any thread. Real-time: no.
class ComponentList {
 public:
  /// The components that a look has found, see Looks.
  struct Found {
    Looks::Look look;  // destroyed after the pointers
    std::vector<std::shared_ptr<Loaded>> all;

    auto begin() const noexcept { return all.begin(); }
    auto end() const noexcept { return all.end(); }
  };

  Found all() const;
  std::shared_ptr<Loaded> find(std::string_view name) const;  // nullptr: there is none
  /// Throws Error if there is none, or if it is being unloaded.
  std::shared_ptr<Loaded> with_id(std::uint64_t id) const;
  /// All components, except those that are being unloaded.
  std::vector<LoadedComponent> listed() const;
  /// The executor that the component's description names; empty: it names none, or no component has
  /// this node.
  std::string executor_of(const Node& node, const CallbackGroup& group) const;
  /// Ready when all looks that have begun so far have ended.
  std::future<void> end_of_looks() { return shared_.lock()->looks.end_of_present(); }

  Plan plan() const;
  void set_plan(Plan plan) { std::swap(shared_.lock()->plan, plan); }

  /// Throws Error if a component has this name.
  void check_is_free(const std::string& name) const;
  /// Adds the component, and assigns its id.
  void add(const std::shared_ptr<Loaded>& loaded, std::vector<Plan::Callback> callbacks = {});
  void set_leaving(Loaded& loaded, bool is_leaving);
  void remove(const Loaded& loaded);
  /// Destroys the components, in reverse order of construction.
  void clear();

  /// A callback of this node threw. Returns the policy of the description for exceptions, and marks
  /// the component for take_failed() if its node must leave its executors. nullopt: there is no
  /// such component.
  std::optional<OnException> fails(std::string_view name);
  Found take_failed();

 private:
  struct Shared {
    std::vector<std::shared_ptr<Loaded>> components;
    Looks looks;  // at `components`
    Plan plan;
    std::uint64_t last_id = 0;

    std::shared_ptr<Loaded> find(std::string_view name) const;
  };

  detail::Guarded<Shared> shared_;
};

/// Constructs a component as described. On failure, adds errors and returns nullptr.
std::shared_ptr<Loaded> make_component(const ContainerSetting& setting,
                                       const ComponentDescription& component,
                                       std::vector<std::string>& errors);
/// Constructs all components of the description; adds errors to the setting.
void make_components(ContainerSetting& setting, ComponentList& components);
/// Calls Completing::complete() once. No callback of the component may run any more.
void complete(Loaded& loaded, ContainerSetting& setting);

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_LIST_HPP_
