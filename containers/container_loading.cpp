// What changes in a running container: components come and go, callbacks get other parameters.
// SPDX-License-Identifier: Apache-2.0
#include <future>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/container_services.hpp"
#include "takt/containers/guarantees.hpp"

namespace takt {

// Adds the component to the list and the plan. Throws Error, and changes nothing, if its executors
// would be overloaded or a chain could miss its deadline.
void Container::admit(const std::shared_ptr<Loaded>& loaded) {
  components_->check_is_free(loaded->node()->fully_qualified_name());
  Guarantees::Errors errors = guarantees_->lost_by(*loaded);
  for (std::string& error : guarantees_->too_much(loaded.get())) errors.push_back(std::move(error));
  if (!errors.empty()) throw ConfigurationError(errors);
  components_->add(loaded, callbacks_of(loaded->node()));
}

LoadedComponent Container::load(ComponentDescription component) {
  if (!component.type.empty()) find_component(component.type, component.library);
  executors_->choose(component);
  std::vector<std::string> errors;
  const std::shared_ptr<Loaded> loaded = make_component(*setting_, component, errors);
  if (loaded == nullptr) throw ConfigurationError(errors);
  admit(loaded);
  const std::shared_ptr<Node>& node = loaded->node();
  for (const auto& entity : node->entities()) {
    // The measured time starts at the loading, not at the container's start.
    if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
  }
  try {
    setting_->modes->serve_as_in_force(node);
    executors_->place(*loaded);
    services_->serve(*loaded);
    lifecycle_->add(*loaded);
  } catch (...) {
    executors_->ignore(*loaded);
    components_->remove(*loaded);
    throw;
  }
  watch_->changed("'" + node->fully_qualified_name() + "' was loaded");
  return {loaded->id, node->fully_qualified_name(), component.type, component.where};
}

std::shared_ptr<Loaded> Container::begin_to_unload(std::uint64_t id) {
  const std::shared_ptr<Loaded> loaded = components_->with_id(id);
  executors_->check_removable(*loaded);
  components_->set_leaving(*loaded, true);
  return loaded;
}

void Container::unload(std::uint64_t id, Nanoseconds limit) {
  std::shared_ptr<Loaded> loaded = begin_to_unload(id);
  const std::string name = loaded->node()->fully_qualified_name();
  watch_->changed("'" + name + "' was unloaded");
  std::future<void> done = unloading_threads_->run([this, loaded]() mutable {
    if (LifecycleNode* node = loaded->lifecycle()) node->bring_down();
    remove(loaded);
    // A look that begins from here on does not find the component, see Looks.
    const std::future<void> is_unseen = components_->end_of_looks();
    loaded.reset();  // the component is destroyed, here or with the last look
    is_unseen.wait();
  });
  loaded.reset();
  if (done.wait_for(limit) == std::future_status::timeout) {
    throw Error(
        fmt::format("component {} '{}' still runs a callback after {}", id, name, to_string(limit)),
        "it is destroyed when the callback returns");
  }
  done.get();
}

void Container::unload_here(std::uint64_t id) {
  const std::shared_ptr<Loaded> loaded = begin_to_unload(id);
  watch_->changed("'" + loaded->node()->fully_qualified_name() + "' was unloaded");
  remove(loaded);
}

// May take long: waits for running callbacks.
void Container::remove(const std::shared_ptr<Loaded>& loaded) {
  try {
    executors_->displace(*loaded);
  } catch (...) {
    components_->set_leaving(*loaded, false);
    throw;
  }
  // Requests in progress are still answered: destroying a service waits for its callback.
  loaded->services.reset();
  loaded->heartbeat.reset();
  complete(*loaded, *setting_);
  components_->remove(*loaded);
}

void Container::change_parameters(const std::string& text) {
  const ComponentList::Found look = components_->all();
  Guarantees::Changes changes;
  std::vector<std::string> names;
  for (const LoadedComponent& loaded : components()) names.push_back(loaded.name);
  for (auto& [name, of_node] : read_parameter_changes(text)) {
    const std::string full = name.starts_with('/') ? name : "/" + name;
    const std::shared_ptr<Loaded> loaded = components_->find(full);
    if (loaded == nullptr) {
      throw Error(fmt::format("no component is called '{}'", full), suggest(full, names));
    }
    loaded->node()->check_callback_parameters(of_node);
    changes.emplace_back(loaded->node(), std::move(of_node));
  }
  const Guarantees::Errors errors = guarantees_->lost_by(changes);
  if (!errors.empty()) throw ConfigurationError(errors);
  for (const auto& [node, of_node] : changes) node->set_callback_parameters(of_node);
  watch_->changed("parameters of callbacks have changed");
}

}  // namespace takt
