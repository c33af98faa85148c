// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component_list.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"

namespace takt {

std::shared_ptr<Loaded> ComponentList::Shared::find(std::string_view name) const {
  const auto found = std::find_if(components.begin(), components.end(), [&](const auto& loaded) {
    return loaded->node()->fully_qualified_name() == name;
  });
  return found != components.end() ? *found : nullptr;
}

ComponentList::Found ComponentList::all() const {
  const auto shared = shared_.lock();
  return {shared->looks.begin(), shared->components};
}

std::shared_ptr<Loaded> ComponentList::find(std::string_view name) const {
  return shared_.lock()->find(name);
}

std::shared_ptr<Loaded> ComponentList::with_id(std::uint64_t id) const {
  const auto shared = shared_.lock();
  std::vector<std::string> ids;
  for (const auto& loaded : shared->components) {
    if (loaded->id == id && loaded->is_leaving) {
      throw Error(fmt::format("component {} is being unloaded already", id),
                  "it is destroyed when its callbacks have returned");
    }
    if (loaded->id == id) return loaded;
    ids.push_back(std::to_string(loaded->id));
  }
  throw Error(fmt::format("there is no component {}", id),
              ids.empty() ? "none is loaded" : fmt::format("loaded: {}", fmt::join(ids, ", ")));
}

std::vector<LoadedComponent> ComponentList::listed() const {
  const auto shared = shared_.lock();
  std::vector<LoadedComponent> result;
  for (const auto& loaded : shared->components) {
    if (loaded->is_leaving) continue;
    result.push_back({loaded->id, loaded->node()->fully_qualified_name(), loaded->description.type,
                      loaded->description.where});
  }
  return result;
}

std::string ComponentList::executor_of(const Node& node, const CallbackGroup& group) const {
  const auto shared = shared_.lock();
  for (const auto& loaded : shared->components)
    if (loaded->node().get() == &node) return loaded->executor_of(group);
  return "";
}

Plan ComponentList::plan() const {
  const auto shared = shared_.lock();
  Plan plan = shared->plan;
  plan.look = shared->looks.begin();
  return plan;
}

void ComponentList::check_is_free(const std::string& name) const {
  const auto shared = shared_.lock();
  if (const auto other = shared->find(name)) {
    throw Error(fmt::format("component {} is called '{}' already", other->id, name),
                other->is_leaving ? "it is being unloaded; wait" : "give each its own name");
  }
}

void ComponentList::add(const std::shared_ptr<Loaded>& loaded,
                        std::vector<Plan::Callback> callbacks) {
  const auto shared = shared_.lock();
  shared->components.push_back(loaded);
  std::move(callbacks.begin(), callbacks.end(), std::back_inserter(shared->plan.callbacks));
  loaded->id = ++shared->last_id;
}

void ComponentList::set_leaving(Loaded& loaded, bool is_leaving) {
  const auto shared = shared_.lock();
  loaded.is_leaving = is_leaving;
}

void ComponentList::remove(const Loaded& loaded) {
  std::vector<Plan::Callback> gone;  // destroyed without the lock
  const auto shared = shared_.lock();
  auto& callbacks = shared->plan.callbacks;
  const auto first =
      std::stable_partition(callbacks.begin(), callbacks.end(),
                            [&](const auto& each) { return each.node != loaded.node(); });
  gone.assign(std::make_move_iterator(first), std::make_move_iterator(callbacks.end()));
  callbacks.erase(first, callbacks.end());
  std::erase_if(shared->components, [&](const auto& entry) { return entry.get() == &loaded; });
}

void ComponentList::clear() {
  std::vector<std::shared_ptr<Loaded>> components;
  components.swap(shared_.lock()->components);
  while (!components.empty()) components.pop_back();
}

std::optional<OnException> ComponentList::fails(std::string_view name) {
  const auto shared = shared_.lock();
  const auto loaded = shared->find(name);
  if (loaded == nullptr) return {};
  const OnException policy = loaded->description.on_exception;
  loaded->has_failed = policy == OnException::remove_node;
  return policy;
}

ComponentList::Found ComponentList::take_failed() {
  const auto shared = shared_.lock();
  Found failed{shared->looks.begin(), {}};
  for (const auto& loaded : shared->components)
    if (std::exchange(loaded->has_failed, false)) failed.all.push_back(loaded);
  return failed;
}

}  // namespace takt
