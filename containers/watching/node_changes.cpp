// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/node_changes.hpp"

#include <algorithm>
#include <mutex>
#include <tuple>

#include <fmt/format.h>

#include "takt/entities/timer.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {
namespace {

std::uint32_t deactivations_of(const Node* node) {
  const auto* const managed = dynamic_cast<const LifecycleNode*>(node);
  return managed != nullptr ? managed->deactivations() : 0;
}

auto numbers(const CallbackParameters& of) {
  return std::tuple(of.priority, of.deadline, of.period, of.budget, of.criticality, of.overrun,
                    of.releases);
}

/// In simulated time, timers may run at any speed.
bool is_simulated(const Entity& entity) {
  const auto* const timer = dynamic_cast<const Timer*>(&entity);
  if (timer == nullptr) return false;
  const auto simulated = timer->clock().as_simulated();
  return simulated != nullptr && simulated->simulates();
}

}  // namespace

// Its executor may keep it for a while.
bool was_let_go(const std::shared_ptr<Entity>& entity) {
  if (entity == nullptr) return true;
  const std::lock_guard lock(ownership_mutex());
  return entity->is_retired();
}

NodeChanges::NodeChanges(const ModelledProcess& process) {
  for (const ModelledProcess::Callback& callback : process.callbacks) {
    callbacks_.push_back(
        {.name = callback.node->fully_qualified_name() + "/" + callback.entity->name(),
         .entity = callback.entity,
         .node = callback.node,
         .parameters = callback.parameters()});
  }
}

void NodeChanges::begin() {
  for (Watched& watched : callbacks_)
    watched.deactivations = deactivations_of(watched.node.lock().get());
}

std::vector<NodeChanges::Found> NodeChanges::look() const {
  std::vector<Found> found;
  for (const Watched& watched : callbacks_) look_at(watched, found);
  return found;
}

void NodeChanges::look_at(const Watched& callback, std::vector<Found>& found) {
  const auto node = callback.node.lock();
  if (node == nullptr) return;  // its container has unloaded it
  // Between two looks it may have become active again.
  if (deactivations_of(node.get()) != callback.deactivations) {
    const std::string& name = node->fully_qualified_name();
    found.push_back({name + " active", fmt::format("'{}' was deactivated", name)});
  }
  const auto entity = callback.entity.lock();
  if (was_let_go(entity)) {
    found.push_back({callback.name + " gone", fmt::format("'{}' was let go", callback.name)});
    return;
  }
  if (numbers(node->callback_parameters(*entity)) != numbers(callback.parameters)) {
    found.push_back({callback.name + " parameters",
                     fmt::format("the parameters of '{}' are others", callback.name)});
  }
  if (is_simulated(*entity)) {
    found.push_back(
        {callback.name + " clock", fmt::format("'{}' follows simulated time", callback.name)});
  }
}

}  // namespace takt
