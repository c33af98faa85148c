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

#include "takt/containers/container.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {

inline constexpr const char* kDefaultExecutor = "default";

struct Container::RunningExecutor {
  std::string name;
  ExecutorDescription description;  // what it was made from, with the overrides
  std::unique_ptr<Executor> executor;
  bool is_own = false;  // serves the container itself: requests or lifecycle
  std::thread thread;
  std::exception_ptr exception;  // read when `failed`
  std::atomic<bool> failed{false};
};

struct Container::Loaded {
  std::uint64_t id = 0;
  ComponentDescription description;
  std::unique_ptr<Component> component;
  std::shared_ptr<void> services, heartbeat;  // of this component, on the container's own node
  // Guarded as Shared is.
  bool is_leaving = false;
  bool has_failed = false;  // a callback threw: remove it from its executors

  std::mutex displacing;
  bool is_displaced = false;
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

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_PARTS_HPP_
