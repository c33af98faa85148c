// The container's data about each executor and each component. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_PARTS_HPP_
#define TAKT_CONTAINERS_CONTAINER_PARTS_HPP_

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "takt/containers/container.hpp"
#include "takt/containers/running_executors.hpp"
#include "takt/containers/running_trace.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {

inline constexpr const char* kDefaultExecutor = "default";

struct Container::Loaded {
  std::uint64_t id = 0;
  ComponentDescription description;
  std::unique_ptr<Component> component;
  std::shared_ptr<void> services, heartbeat;  // of this component, on the container's own node
  // Guarded as Shared is.
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
};

/// Begins executors with the first callbacks of components.
/// Thread safety: from any thread. Real-time: no.
class Container::FirstCallbacks final : public NodeListener {
 public:
  explicit FirstCallbacks(Container& container) : container_(container) {}
  /// Those of the callbacks that it has.
  void begin(const Loaded& loaded);
  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node& /*node*/, const std::shared_ptr<CallbackGroup>& /*group*/) override {}
  void parameters_changed(Node& /*node*/) override {}

 private:
  void begin(const Loaded& loaded, const CallbackGroup& group);
  void begin(RunningExecutor& running);

  Container& container_;
};

/// What a look has found.
struct Container::Components {
  Looks::Look look;  // ends when the pointers have gone
  std::vector<std::shared_ptr<Loaded>> all;

  auto begin() const noexcept { return all.begin(); }
  auto end() const noexcept { return all.end(); }
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_PARTS_HPP_
