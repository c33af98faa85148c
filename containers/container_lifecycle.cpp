// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_lifecycle.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/logger.hpp"

namespace takt {
namespace {

constexpr const char* kLifecycleThread = "lifecycle";
constexpr auto kShutDownLimit = std::chrono::seconds(10);

}  // namespace

// Heartbeats need a thread that no transition callback can block: they show that the process is
// alive.
void ContainerLifecycle::make(ContainerExecutors& executors) {
  const LifecycleDescription& lifecycle = *setting_.description.lifecycle;
  node_ = std::make_shared<Node>(
      setting_.own_name("_lifecycle"),
      NodeOptions{.clock = setting_.overrides.clock, .participant = setting_.participant});
  heartbeats_ = std::make_unique<HeartbeatSender>(*node_, lifecycle.heartbeat);
  if (lifecycle.manager.empty() || lifecycle.manager == setting_.description.name) {
    manager_ = std::make_unique<LifecycleManager>(*node_, lifecycle);
  }
  for (const auto& loaded : components_.all()) {
    const std::string& name = loaded->node()->fully_qualified_name();
    const bool is_managed = std::any_of(lifecycle.bring_up.begin(), lifecycle.bring_up.end(),
                                        [&](const auto& managed) { return managed.name == name; });
    if (!is_managed || std::dynamic_pointer_cast<LifecycleNode>(loaded->node())) continue;
    setting_.errors.push_back(
        fmt::format("{}: '{}' has no lifecycle; derive '{}' from LifecycleNode, or "
                    "remove it from 'bring_up'",
                    lifecycle.where, name, loaded->description.type));
  }
  setting_.throw_errors();
  executors.make_own(kLifecycleThread).add_node(node_);
}

void ContainerLifecycle::add(Loaded& loaded) {
  const auto node = std::dynamic_pointer_cast<LifecycleNode>(loaded.node());
  if (heartbeats_ != nullptr && node != nullptr) loaded.heartbeat = heartbeats_->add(node);
}

void ContainerLifecycle::bring_up() {
  if (manager_ != nullptr) return manager_->bring_up();
  // Requests from outside may configure nodes, a program its own; a simulation says it once.
  if (setting_.participant != nullptr || setting_.overrides.find_node || setting_.is_simulated())
    return;
  for (const std::string& name : unconfigured()) {
    log(LogLevel::warn,
        "lifecycle: nobody can configure '{}'; list it in `lifecycle: {{bring_up: [...]}}`", name);
  }
}

std::vector<std::string> ContainerLifecycle::unconfigured() const {
  std::vector<std::string> names;
  for (const auto& loaded : components_.all()) {
    const LifecycleNode* node = loaded->lifecycle();
    if (node == nullptr || node->get_current_state() != LifecycleState::unconfigured) continue;
    names.push_back(node->fully_qualified_name());
  }
  return names;
}

std::vector<std::string> ContainerLifecycle::active() const {
  std::vector<std::string> names;
  for (const auto& loaded : components_.all()) {
    const LifecycleNode* node = loaded->lifecycle();
    if (node == nullptr) continue;
    const bool is_active = node->get_current_state() == LifecycleState::active;
    if (is_active || node->deactivations() != 0) names.push_back(node->fully_qualified_name());
  }
  return names;
}

void ContainerLifecycle::shut_down() {
  if (manager_ == nullptr) return;
  for (auto& failure : manager_->failures()) setting_.fail(std::move(failure));
  for (const std::string& name : manager_->shut_down(kShutDownLimit))
    setting_.note(fmt::format("lifecycle: {} was not shut down", name));
}

void ContainerLifecycle::bring_down_rest(UnloadingThreads& threads) {
  ComponentList::Found left = components_.all();
  std::erase_if(left.all, [](const auto& loaded) {
    const LifecycleNode* node = loaded->lifecycle();
    return node == nullptr || node->get_current_state() == LifecycleState::finalized;
  });
  if (left.all.empty()) return;
  const auto done = threads.run([left] {
    for (auto loaded = left.all.rbegin(); loaded != left.all.rend(); ++loaded) {
      (*loaded)->lifecycle()->bring_down();
    }
  });
  done.wait_for(kShutDownLimit);
  for (const auto& loaded : left) {
    if (loaded->lifecycle()->get_current_state() == LifecycleState::finalized) continue;
    setting_.note(
        fmt::format("lifecycle: {} was not shut down", loaded->node()->fully_qualified_name()));
  }
}

}  // namespace takt
