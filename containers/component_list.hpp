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
  std::once_flag completed;  // who finds it under way waits for it

  LifecycleNode* lifecycle() const noexcept {
    return dynamic_cast<LifecycleNode*>(component->node.get());
  }
  const std::shared_ptr<Node>& node() const noexcept { return component->node; }
  /// The executor that the description gives this group; empty: the component's executor.
  std::string own_executor(const CallbackGroup& group) const {
    const auto found = description.callback_groups.find(group.name());
    return found != description.callback_groups.end() ? found->second.executor : "";
  }
  /// Of the group, or of the component; empty: the description names none.
  std::string executor_of(const CallbackGroup& group) const {
    const std::string own = own_executor(group);
    return own.empty() ? description.executor : own;
  }
};

/// The components, and the plan of their callbacks. Under its lock no other one is taken, and
/// nothing is destroyed.
/// Thread safety: from any thread. Real-time: no.
class ComponentList {
 public:
  /// What a look has found.
  struct Found {
    Looks::Look look;  // ends when the pointers have gone
    std::vector<std::shared_ptr<Loaded>> all;

    auto begin() const noexcept { return all.begin(); }
    auto end() const noexcept { return all.end(); }
  };

  Found all() const;
  std::shared_ptr<Loaded> find(std::string_view name) const;  // nullptr: there is none
  /// Throws Error if there is none, or it is leaving.
  std::shared_ptr<Loaded> with_id(std::uint64_t id) const;
  /// Without those that are leaving.
  std::vector<LoadedComponent> listed() const;
  /// As its description names it; empty: that names none, or there is no such component.
  std::string executor_of(const Node& node, const CallbackGroup& group) const;
  /// Ready when all looks that have begun so far have ended.
  std::future<void> end_of_looks() { return shared_.lock()->looks.end_of_present(); }

  Plan plan() const;
  void set_plan(Plan plan) { std::swap(shared_.lock()->plan, plan); }

  /// Throws Error if a component has it.
  void check_is_free(const std::string& name) const;
  /// Gives it its number.
  void add(const std::shared_ptr<Loaded>& loaded, std::vector<Plan::Callback> callbacks = {});
  void set_leaving(Loaded& loaded, bool is_leaving);
  void remove(const Loaded& loaded);
  /// Destroys them, in reverse order of construction.
  void clear();

  /// A callback of this node threw. Returns what the description says of that, and keeps it for
  /// take_failed() if the node must leave its executors; nullopt: there is no such component.
  std::optional<OnException> fails(std::string_view name);
  Found take_failed();

 private:
  struct Shared {
    std::vector<std::shared_ptr<Loaded>> components;
    Looks looks;  // at these
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
/// Those of the description, with what is wrong with them.
void make_components(ContainerSetting& setting, ComponentList& components);
/// None of its callbacks runs now.
void complete(Loaded& loaded, ContainerSetting& setting);

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_LIST_HPP_
