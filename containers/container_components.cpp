// Components of a container: making, loading and unloading them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <future>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/container_parts.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/unloading_threads.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace takt {
namespace {

// Of a request as of a file: each is looked up among all names.
// Limit: errors about the names of a component's settings. At it: the rest is not looked for. Seen:
// the last error says so.
constexpr std::size_t kMostErrors = 100;

// A launch file gives its rules to each of its components.
void note_unused_remaps(const Node& node, const std::vector<std::string>& unused) {
  // Limit: remap rules without a topic that a component's note names. At it: the others are
  // counted. Seen: the note.
  constexpr std::size_t kMostNamed = 3;
  if (unused.empty()) return;
  const auto named = static_cast<std::ptrdiff_t>(std::min(unused.size(), kMostNamed));
  std::string names =
      fmt::format("'{}'", fmt::join(unused.begin(), unused.begin() + named, "', '"));
  if (unused.size() > kMostNamed) {
    names += fmt::format(" and {} more", unused.size() - kMostNamed);
  }
  log(LogLevel::info, "note: {} has no topic {}: {} so far", node.fully_qualified_name(), names,
      unused.size() == 1 ? "its remap rule does nothing" : "their remap rules do nothing");
}

// Checks names against the constructed node: only its constructor creates timers, parameters and
// topics.
void check_names(const ComponentDescription& component, const Node& node,
                 std::vector<std::string>& errors) {
  // Returns false when there are enough.
  const auto add = [&](const SourceLine& where, std::string_view what, const std::string& name,
                       const std::string& what_to_do) {
    errors.push_back(
        Error(fmt::format("{} has no {} '{}'", noun_of(component), what, name), what_to_do, where)
            .what());
    if (errors.size() < kMostErrors) return true;
    errors.push_back(Error("more errors follow", "fix these first", where).what());
    return false;
  };
  const auto line = [&](const auto& lines, const std::string& name) {
    const auto found = lines.find(name);
    return found != lines.end() ? found->second : component.where;
  };
  const std::vector<std::string> declared = node.list_parameters().names;
  for (const std::string& name : node.unused_parameters()) {
    const auto& where = line(component.parameter_lines, name);
    if (!add(where, "parameter", name, suggest(name, declared))) return;
  }
  const std::vector<std::string> unused = node.unused_remaps();
  if (component.guest) {  // as a container of ROS 2 does, for which launch files are written
    note_unused_remaps(node, unused);
  } else {
    for (const std::string& name : unused) {
      if (!add(line(component.remap_lines, name), "topic to remap", name, "")) return;
    }
  }
  for (const std::string& name : node.timers_of_one_name()) {
    errors.push_back(Error(fmt::format("{} makes two timers called '{}'", noun_of(component), name),
                           "give each its own name in the code", component.where)
                         .what());
  }
  const auto check = [&](const auto& described, const auto& objects, std::string_view what) {
    std::set<std::string> names;
    for (const auto& object : objects) names.insert(object->name());
    for (const auto& [name, description] : described) {
      if (names.contains(name)) continue;
      const std::vector<std::string> valid(names.begin(), names.end());
      if (!add(description.where, what, name, suggest(name, valid))) return;
    }
  };
  check(component.callback_groups, node.groups(), "callback group");
  check(component.callbacks, node.entities(), "callback");
}

// Sets the parameters before executors get the callbacks, so that no executor needs an update.
void set_parameters(const ComponentDescription& component, Node& node,
                    std::vector<std::string>& errors) {
  CallbackParameterChanges changes;
  std::string where = component.where;
  for (const auto& [name, group] : component.callback_groups) {
    changes.callback_groups[name] = group.parameters;
    where = group.where;
  }
  for (const auto& [name, callback] : component.callbacks) {
    changes.callbacks[name] = callback.parameters;
    where = callback.where;
  }
  try {
    node.set_callback_parameters(changes);
  } catch (const Error& error) {
    errors.push_back(
        Error(fmt::format("{}: {}", noun_of(component), error.what()), "", where).what());
  }
}

// Where one executor runs all, groups come to it with their node, if they may.
bool is_placed_alone(const ContainerOverrides& overrides, const CallbackGroup& group) {
  return !overrides.is_merged() || !group.automatically_add_to_executor();
}

}  // namespace

void Container::make_components() {
  for (const ComponentDescription& component : description_.components) {
    if (overrides_.find_node && overrides_.find_node(component) == nullptr) continue;  // not yet
    if (auto loaded = make(component, errors_)) {
      const auto shared = shared_.lock();
      loaded->id = ++shared->last_id;
      shared->components.push_back(std::move(loaded));
    }
  }
  if (!loaded_components().all.empty() && errors_.empty()) check_topics();
  for (std::string& error : name_conflicts(components())) errors_.push_back(std::move(error));
}

// Checks that the topics of the file exist.
void Container::check_topics() {
  std::vector<std::string> names;
  for (const auto& loaded : loaded_components()) {
    for (std::string& name : loaded->node()->topics()) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (const auto& [name, where] : description_.topic_lines) {
    if (std::binary_search(names.begin(), names.end(), name)) continue;
    errors_.push_back(
        Error(fmt::format("no component has the topic '{}'", name), suggest(name, names), where)
            .what());
  }
}

std::unique_ptr<Component> Container::construct(const ComponentDescription& component,
                                                const NodeOptions& options) const {
  if (component.type.empty()) {
    if (overrides_.find_node) {
      return std::make_unique<Component>(Component{overrides_.find_node(component)});
    }
    throw Error("a program makes it", "start that with TAKT_CONFIG=" + description_.file);
  }
  if (!overrides_.on_making) return takt::components().make(component.type, options);
  struct EndOfMaking {
    const std::function<void(std::string_view)>& on_making;
    ~EndOfMaking() { on_making(""); }
  };
  overrides_.on_making(component.name.empty() ? component.type : component.name);
  const EndOfMaking end{overrides_.on_making};
  return takt::components().make(component.type, options);
}

// Constructs a component as described; on failure adds errors and returns nullptr.
std::shared_ptr<Container::Loaded> Container::make(const ComponentDescription& component,
                                                   Errors& errors) const {
  NodeOptions options;
  options.name = component.name;
  options.name_space = component.name_space;
  options.parameters = component.parameters;
  options.remap = component.remap;
  options.qos = description_.topics;
  options.log_level = component.log_level;
  options.participant = participant_;
  options.guest = component.guest;
  auto loaded = std::make_shared<Loaded>();
  loaded->description = component;
  options.clock = overrides_.clock;
  options.time_source = time_source_;
  options.end_container = overrides_.end;
  options.request_mode = [modes = modes_](std::string_view mode) { return modes->request(mode); };
  const std::size_t before = errors.size();
  const auto failed = [&](std::string_view why) {
    errors.push_back(
        Error(fmt::format("{} could not be made: {}", noun_of(component), why), "", component.where)
            .what());
  };
  try {
    loaded->component = construct(component, options);
    check_names(component, *loaded->node(), errors);
    if (errors.size() == before) set_parameters(component, *loaded->node(), errors);
  } catch (const std::exception& error) {
    failed(error.what());
  } catch (...) {
    failed("it threw an object that is not a std::exception");
  }
  return errors.size() == before ? loaded : nullptr;
}

void Container::end_components() noexcept {
  for (const auto& loaded : loaded_components()) {
    if (const auto on_end = std::exchange(loaded->component->on_end, {})) on_end();
  }
}

// Throws Error if the component names an executor that does not exist or cannot run it.
void Container::choose_executors(ComponentDescription& component) const {
  const std::vector<std::string> names = executor_names();
  const auto exists = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto check = [&](const std::string& name) {
    if (exists(name)) return;
    throw Error(fmt::format("no executor is called '{}'", name),
                names.empty() ? "describe one under 'executors'" : suggest(name, names),
                component.where);
  };
  if (component.executor.empty()) {
    component.executor =
        exists(kDefaultExecutor) || names.empty() ? kDefaultExecutor : names.front();
  }
  check(component.executor);
  for (const auto& [name, group] : component.callback_groups) {
    if (!group.executor.empty()) check(group.executor);
  }
  if (component.on_exception == OnException::remove_node && failed_ == nullptr) {
    throw Error("'on_exception: remove_node' needs a thread that removes the node",
                "add a thread called 'container'", component.where);
  }
}

// Adds the component to the list and the plan. Throws Error, and changes nothing, if its executors
// would be overloaded or a chain could miss its deadline.
void Container::admit(const std::shared_ptr<Loaded>& loaded) {
  const std::shared_ptr<Node>& node = loaded->node();
  Errors errors = lost_guarantees(*loaded);  // without the mutex, as it may take its time
  std::vector<Plan::Callback> refused;       // destroyed without the lock
  const auto shared = shared_.lock();
  if (const auto other = shared->find(node->fully_qualified_name())) {
    throw Error(
        fmt::format("component {} is called '{}' already", other->id, node->fully_qualified_name()),
        other->is_leaving ? "it is being unloaded; wait" : "give each its own name");
  }
  shared->components.push_back(loaded);
  for (const auto& entity : node->entities()) {
    Nanoseconds period = entity->period();
    if (period == Nanoseconds::zero()) {
      period = node->callback_parameters(*entity).period.value_or(period);
    }
    shared->plan.callbacks.push_back({.node = node, .entity = entity, .period = period});
  }
  for (std::string& error : too_much_for_executors(*shared)) errors.push_back(std::move(error));
  if (!errors.empty()) {
    refused = shared->forget(*loaded);
    throw ConfigurationError(errors);
  }
  loaded->id = ++shared->last_id;
}

LoadedComponent Container::load(ComponentDescription component) {
  if (!component.type.empty()) find_component(component.type, component.library);
  choose_executors(component);
  Errors errors;
  const std::shared_ptr<Loaded> loaded = make(component, errors);
  if (loaded == nullptr) throw ConfigurationError(errors);
  admit(loaded);
  const std::shared_ptr<Node>& node = loaded->node();
  for (const auto& entity : node->entities()) {
    // The measured time starts at the loading, not at the container's start.
    if (auto* timer = dynamic_cast<Timer*>(entity.get())) timer->begin_phase();
  }
  try {
    serve_as_in_present_mode(node);
    place(*loaded);
    serve(*loaded);
  } catch (...) {
    node->remove_listener(*first_callbacks_);
    const auto gone = shared_.lock()->forget(*loaded);
    throw;
  }
  changed("'" + node->fully_qualified_name() + "' was loaded");
  return {loaded->id, node->fully_qualified_name(), component.type, component.where};
}

std::shared_ptr<Container::Loaded> Container::Shared::find(std::string_view name) const {
  const auto found = std::find_if(components.begin(), components.end(), [&](const auto& loaded) {
    return loaded->node()->fully_qualified_name() == name;
  });
  return found != components.end() ? *found : nullptr;
}

std::vector<Plan::Callback> Container::Shared::forget(const Loaded& loaded) {
  const auto first =
      std::stable_partition(plan.callbacks.begin(), plan.callbacks.end(),
                            [&](const auto& entry) { return entry.node != loaded.node(); });
  std::vector<Plan::Callback> gone(std::make_move_iterator(first),
                                   std::make_move_iterator(plan.callbacks.end()));
  plan.callbacks.erase(first, plan.callbacks.end());
  std::erase_if(components, [&](const auto& entry) { return entry.get() == &loaded; });
  return gone;
}

Container::Components Container::loaded_components() const {
  const auto shared = shared_.lock();
  return {shared->looks.begin(), shared->components};
}

std::shared_ptr<Container::Loaded> Container::begin_to_unload(std::uint64_t id) {
  const auto shared = shared_.lock();
  std::shared_ptr<Loaded> loaded;
  std::vector<std::string> ids;
  for (const auto& candidate : shared->components) {
    if (candidate->id == id) loaded = candidate;
    ids.push_back(std::to_string(candidate->id));
  }
  if (loaded == nullptr) {
    throw Error(fmt::format("there is no component {}", id),
                ids.empty() ? "none is loaded" : fmt::format("loaded: {}", fmt::join(ids, ", ")));
  }
  if (loaded->is_leaving) {
    throw Error(fmt::format("component {} is being unloaded already", id),
                "it is destroyed when its callbacks have returned");
  }
  check_removable(*loaded);
  loaded->is_leaving = true;
  return loaded;
}

void Container::unload(std::uint64_t id, Nanoseconds limit) {
  std::shared_ptr<Loaded> loaded = begin_to_unload(id);
  const std::string name = loaded->node()->fully_qualified_name();
  changed("'" + name + "' was unloaded");
  std::future<void> done = unloading_threads_->run([this, loaded]() mutable {
    if (LifecycleNode* node = loaded->lifecycle()) node->bring_down();
    remove(loaded);
    // A look that begins from here on does not find it.
    const std::future<void> is_unseen = shared_.lock()->looks.end_of_present();
    loaded.reset();  // the component goes, here or with the last look
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
  changed("'" + loaded->node()->fully_qualified_name() + "' was unloaded");
  remove(loaded);
}

// The executors would refuse as well, but only after its node was brought down.
void Container::check_removable(const Loaded& loaded) const {
  std::vector<std::string> used{overrides_.executor};
  if (!overrides_.is_merged()) {
    used = {loaded.description.executor.empty() ? kDefaultExecutor : loaded.description.executor};
    for (const auto& group : loaded.node()->groups()) used.push_back(loaded.own_executor(*group));
  }
  for (const auto& running : *executors_) {
    if (running->is_own || std::find(used.begin(), used.end(), running->name) == used.end() ||
        !executors().traits(running->description.type).frozen) {
      continue;
    }
    throw Error(fmt::format("executor '{}' is static: nothing can be removed after its first spin",
                            running->name),
                "choose 'single_threaded'");
  }
}

// Callbacks may take their time.
void Container::remove(const std::shared_ptr<Loaded>& loaded) {
  try {
    displace(*loaded);
  } catch (...) {
    const auto shared = shared_.lock();
    loaded->is_leaving = false;
    throw;
  }
  // What has been asked for is answered, as dropping a service waits for its callback.
  loaded->services.reset();
  loaded->heartbeat.reset();
  complete(*loaded);
  const auto gone = shared_.lock()->forget(*loaded);
}

std::vector<LoadedComponent> Container::components() const {
  const auto shared = shared_.lock();
  std::vector<LoadedComponent> result;
  for (const auto& loaded : shared->components) {
    if (loaded->is_leaving) continue;
    result.push_back({loaded->id, loaded->node()->fully_qualified_name(), loaded->description.type,
                      loaded->description.where});
  }
  return result;
}

std::vector<std::string> Container::unconfigured() const {
  std::vector<std::string> names;
  for (const auto& loaded : loaded_components()) {
    const LifecycleNode* node = loaded->lifecycle();
    if (node == nullptr || node->get_current_state() != LifecycleState::unconfigured) continue;
    names.push_back(node->fully_qualified_name());
  }
  return names;
}

void Container::serve(Loaded& loaded) {
  const bool serves_itself = loaded.description.type.empty();  // as nodes of programs do
  if (manager_ != nullptr && !serves_itself) loaded.services = manager_->serve(loaded.node());
  const auto node = std::dynamic_pointer_cast<LifecycleNode>(loaded.node());
  if (heartbeats_ != nullptr && node != nullptr) loaded.heartbeat = heartbeats_->add(node);
}

void Container::place(const Loaded& loaded) {
  const std::shared_ptr<Node>& node = loaded.node();
  for (const auto& group : node->groups()) {
    const std::string own = loaded.own_executor(*group);
    if (own.empty()) continue;
    if (is_placed_alone(overrides_, *group))
      executor_for(own).executor->add_callback_group(group, node);
    if (!overrides_.is_merged()) continue;
    const SourceLine& where = loaded.description.callback_groups.at(group->name()).where;
    if (where.empty()) continue;  // assigned, not asked for
    note(fmt::format("{}: callback group '{}' of '{}' is on the one executor {}, not on '{}'",
                     where, group->name(), node->name(), overrides_.executor, own));
  }
  executor_for(loaded.description.executor).executor->add_node(node);
  node->add_listener(*first_callbacks_);  // after the executor, which has what is new before this
  first_callbacks_->begin(loaded);
}

// What place has done, undone; waits for running callbacks. If another thread does it, waits for
// that one, unless it waits for this one: the calling thread may be in a callback of the node.
void Container::displace(Loaded& loaded) {
  using enum Loaded::Displacement;
  for (auto found = none; !loaded.displacement.compare_exchange_strong(found, under_way);
       found = none) {
    if (found == done) return;
    const detail::WaitInCallback wait(&loaded.displacement);
    wait.until([&] { return wait.is_for_itself() || loaded.displacement.load() != under_way; });
    if (wait.is_for_itself()) return;
  }
  struct End {
    Loaded& loaded;
    // Not the user's: so `isolated` waits for the node's thread, and holds nothing of it later.
    const detail::Running running{&loaded.displacement, detail::Running::Code::own};
    Loaded::Displacement now = none;
    ~End() {
      loaded.displacement.store(now);
      detail::WaitInCallback::notify_progress();
    }
  } end{loaded};
  const std::shared_ptr<Node>& node = loaded.node();
  node->remove_listener(*first_callbacks_);
  std::vector<std::shared_ptr<CallbackGroup>> removed;
  try {
    for (const auto& group : node->groups()) {
      const std::string own = loaded.own_executor(*group);
      if (own.empty() || !is_placed_alone(overrides_, *group)) continue;
      executor_for(own).executor->remove_callback_group(group, node);
      removed.push_back(group);
    }
    executor_for(loaded.description.executor).executor->remove_node(node);
  } catch (...) {  // one of them refuses: it stays as it was
    for (const auto& group : removed) {
      executor_for(loaded.own_executor(*group)).executor->add_callback_group(group, node);
    }
    node->add_listener(*first_callbacks_);
    throw;
  }
  end.now = done;
}

// None of its callbacks runs now.
void Container::complete(Loaded& loaded) {
  std::call_once(loaded.completed, [&] {
    auto* const completing = dynamic_cast<Completing*>(loaded.node().get());
    const std::string failure = completing != nullptr ? completing->complete() : "";
    if (failure.empty()) return;
    shared_.lock()->failures.push_back(
        fmt::format("{}: {}", loaded.node()->fully_qualified_name(), failure));
  });
}

}  // namespace takt
