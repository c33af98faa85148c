// The parameters of a node's callback groups and callbacks, which take effect together.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>

#include <fmt/format.h>

#include "takt/nodes/node.hpp"
#include "takt/nodes/node_state.hpp"

namespace takt {
namespace {

// The parameters that each named object will have after the changes.
template <class Object>
std::map<Object*, CallbackParameters> after(
    const std::map<std::string, CallbackParameters, std::less<>>& changes,
    const std::vector<std::shared_ptr<Object>>& objects, std::string_view what, const Node& node) {
  std::map<Object*, CallbackParameters> result;
  for (const auto& change : changes) {  // clang 14 cannot capture structured bindings
    const std::string& name = change.first;
    // Of two objects with one name, the older one is about to be dropped.
    const auto object = std::find_if(objects.rbegin(), objects.rend(), [&](const auto& candidate) {
      return candidate->name() == name;
    });
    if (object == objects.rend()) {
      std::vector<std::string> names;
      for (const auto& candidate : objects) names.push_back(candidate->name());
      throw Error(fmt::format("node '{}' has no {} '{}'", node.fully_qualified_name(), what, name),
                  suggest(name, names));
    }
    result[object->get()] = change.second.or_else((*object)->parameters());
  }
  return result;
}

// A timer is released at its own period, whatever its callback states.
void check_period(const Entity& callback, const CallbackParameters& parameters) {
  const Nanoseconds own = callback.period();
  if (own == Nanoseconds::zero() || parameters.period.value_or(own) == own) return;
  throw Error(fmt::format("'{}' is a timer, which is released every {}: it has no 'period' of {}",
                          callback.name(), to_string(own), to_string(*parameters.period)),
              "remove it");
}

}  // namespace

// With the mutex held: the new parameters of each object; throws if one of them is invalid.
Node::ChangedParameters Node::checked(const CallbackParameterChanges& changes,
                                      const std::vector<std::shared_ptr<CallbackGroup>>& groups,
                                      const std::vector<std::shared_ptr<Entity>>& entities) const {
  ChangedParameters changed{after(changes.callback_groups, groups, "callback group", *this),
                            after(changes.callbacks, entities, "callback", *this)};
  const auto of = [](const auto& some, const auto& object) -> const CallbackParameters& {
    const auto found = some.find(object.get());
    return found != some.end() ? found->second : object->parameters();
  };
  for (const auto& [group, parameters] : changed.groups) parameters.check();
  for (const auto& [entity, parameters] : changed.callbacks) {
    parameters.check(entity->period());
    check_period(*entity, parameters);
  }
  for (const auto& entity : entities) {
    of(changed.callbacks, entity)
        .or_else(of(changed.groups, entity->group()))
        .check(entity->period());
  }
  return changed;
}

void Node::check_callback_parameters(const CallbackParameterChanges& changes) const {
  const auto all_groups = groups();
  const auto all_entities = entities();
  const std::lock_guard lock(state_->mutex);
  checked(changes, all_groups, all_entities);
}

void Node::set_callback_parameters(const CallbackParameterChanges& changes) {
  const auto all_groups = groups();
  const auto all_entities = entities();
  ChangedParameters before;
  const auto exchange = [&before](const ChangedParameters& parameters) {
    before = {};
    for (const auto& [group, of_group] : parameters.groups) {
      before.groups.emplace(group, group->parameters());
      group->set_parameters(of_group);
    }
    for (const auto& [entity, of_entity] : parameters.callbacks) {
      before.callbacks.emplace(entity, entity->parameters());
      entity->set_parameters(of_entity);
    }
  };
  const auto notify_listeners = [this] {
    state_->notify([this](NodeListener& listener) { listener.parameters_changed(*this); });
  };
  {
    const std::lock_guard lock(state_->mutex);
    exchange(checked(changes, all_groups, all_entities));
  }
  try {
    notify_listeners();
  } catch (...) {  // a user's scheduler refuses them
    {
      const std::lock_guard lock(state_->mutex);
      exchange(ChangedParameters(before));
    }
    notify_listeners();
    throw;
  }
}

CallbackParameters Node::callback_parameters(const Entity& entity) const {
  const std::lock_guard lock(state_->mutex);
  return entity.parameters().or_else(entity.group()->parameters());
}

}  // namespace takt
