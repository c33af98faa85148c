// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_executors.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/configuration/replace_executors.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace takt {
namespace {

// Changes the executor to the overriding type. Returns which settings of the file that type
// ignores.
std::string override(ExecutorDescription& executor, const ContainerOverrides& overrides) {
  if (!overrides.scheduler.empty()) executor.scheduler = overrides.scheduler;
  if (overrides.executor.empty()) return "";
  executor.type = overrides.executor;
  const ExecutorTraits traits = executors().traits(executor.type);
  std::vector<std::string> unused;
  if (executor.threads.size() > traits.max_threads) {
    unused.push_back(counted(executor.threads.size() - traits.max_threads, "thread"));
  }
  if (!traits.triggered) {
    if (executor.trigger.kind != TriggerOptions::Kind::any) unused.emplace_back("`trigger`");
    if (executor.trigger.let_period != Nanoseconds::zero()) unused.emplace_back("`let`");
    executor.trigger = {};
  }
  const auto takes = [&](const OwnValue& value) { return has_key(traits.keys, value.name); };
  for (const OwnValue& value : executor.own) {
    if (!takes(value)) unused.push_back(fmt::format("`{}`", value.name));
  }
  std::erase_if(executor.own, [&](const OwnValue& value) { return !takes(value); });
  if (!traits.isolates && executor.per != Isolation::node) {
    unused.emplace_back("`per`");
    executor.per = Isolation::node;
  }
  if (!traits.isolates && std::exchange(executor.reentrant_threads, 1) != 1) {
    unused.emplace_back("`reentrant_threads`");
  }
  return unused.empty() ? "" : fmt::format("which cannot use of it: {}", fmt::join(unused, ", "));
}

// Whether a component or a group needs the executor `default`, and the file does not describe it.
bool needs_default_executor(const SystemDescription& description) {
  if (std::any_of(description.executors.begin(), description.executors.end(),
                  [](const auto& executor) { return executor.name == kDefaultExecutor; })) {
    return false;
  }
  const auto uses_default = [](const ComponentDescription& component) {
    return component.executor.empty() || component.executor == kDefaultExecutor ||
           std::any_of(component.callback_groups.begin(), component.callback_groups.end(),
                       [](const auto& group) { return group.second.executor == kDefaultExecutor; });
  };
  return std::any_of(description.components.begin(), description.components.end(), uses_default);
}

}  // namespace

ContainerExecutors::~ContainerExecutors() {
  for (const auto& loaded : components_.all()) loaded->node()->remove_listener(*this);
}

void ContainerExecutors::make(const ExecutorDescription& executor) {
  ExecutorDescription made = executor;
  std::string differs = override(made, setting_.overrides);
  ExecutorOptions options = options_of(made);
  options.scheduler_own = own_values_of(scheduler_of(made), setting_.description);
  options.realtime = setting_.description.realtime;
  options.statistics = setting_.overrides.statistics;
  options.trace_events = setting_.overrides.trace_events;
  options.slices = setting_.overrides.slices;
  options.watchdog = watchdog_;
  options.clock = setting_.overrides.clock;
  options.execution_model = setting_.overrides.execution_model;
  options.limits_chains = limits_chains(setting_.description);
  const ExecutorTraits traits = executors().traits(made.type);
  const bool has_band = executors().traits(executor.type).takes_band;  // the type in the file
  if (!setting_.overrides.executor.empty() && traits.takes_band && !has_band)
    differs = take_band(made, setting_.description);
  for (const std::string& name : made.threads) {
    if (options.threads.size() < traits.max_threads)
      options.threads.push_back(setting_.thread(name));
  }
  RunningExecutor& running = running_.add(made.name, executors().make(made.type, options));
  running.description = std::move(made);
  running.differs = std::move(differs);
}

std::vector<ExecutorDescription> ContainerExecutors::described() const {
  std::vector<ExecutorDescription> all = setting_.description.executors;
  if (needs_default_executor(setting_.description)) all.push_back({.name = kDefaultExecutor});
  return all;
}

void ContainerExecutors::make_all() {
  if (setting_.has_thread("watchdog")) {
    watchdog_ = std::make_shared<Watchdog>(
        setting_.thread("watchdog"), setting_.description.realtime, *setting_.overrides.clock);
    setting_.note(watchdog_->state().refused);
  }
  if (!setting_.overrides.is_merged()) {
    for (const ExecutorDescription& executor : described()) make(executor);
    return;
  }
  // The merged executor uses the threads of the file in their order, then the assigned ones.
  ExecutorDescription all{.name = setting_.overrides.executor};
  for (const ExecutorDescription& executor : setting_.description.executors) {
    all.threads.insert(all.threads.end(), executor.threads.begin(), executor.threads.end());
  }
  make(all);
}

Executor& ContainerExecutors::make_own(const char* name, std::size_t threads) {
  std::vector<ThreadAttributes> attributes(threads, setting_.thread(name));
  for (std::size_t i = 1; i < threads; ++i) attributes[i].name = fmt::format("{}-{}", name, i);
  RunningExecutor& running =
      running_.add(name, executors().make("events", {.name = name,
                                                     .threads = std::move(attributes),
                                                     .realtime = setting_.description.realtime,
                                                     .statistics = StatisticsLevel::off,
                                                     .clock = setting_.overrides.clock}));
  running.is_own = true;
  return *running.executor;
}

// ---- Which one ----

void ContainerExecutors::choose(ComponentDescription& component) const {
  const std::vector<std::string> names = running_.names();
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
  if (component.on_exception == OnException::remove_node && setting_.time_source == nullptr) {
    throw Error("'on_exception: remove_node' needs a thread that removes the node",
                "add a thread called 'container'", component.where);
  }
}

std::string ContainerExecutors::name_for(const std::string& described) const {
  return setting_.overrides.is_merged() ? setting_.overrides.executor
         : described.empty()            ? kDefaultExecutor
                                        : described;
}

RunningExecutor& ContainerExecutors::find(const std::string& name) const {
  return setting_.overrides.is_merged() ? **running_.begin() : running_.named(name_for(name));
}

// A merged executor gets groups with their node, except those that are not added automatically.
bool ContainerExecutors::is_placed_alone(const CallbackGroup& group) const {
  return !setting_.overrides.is_merged() || !group.automatically_add_to_executor();
}

void ContainerExecutors::place(const Loaded& loaded) {
  const std::shared_ptr<Node>& node = loaded.node();
  for (const auto& group : node->groups()) {
    const std::string own = loaded.own_executor(*group);
    if (own.empty()) continue;
    if (is_placed_alone(*group)) find(own).executor->add_callback_group(group, node);
    if (!setting_.overrides.is_merged()) continue;
    const SourceLine& where = loaded.description.callback_groups.at(group->name()).where;
    if (where.empty()) continue;  // assigned by Takt, not requested by the file
    setting_.note(
        fmt::format("{}: callback group '{}' of '{}' is on the one executor {}, not on '{}'", where,
                    group->name(), node->name(), setting_.overrides.executor, own));
  }
  find(loaded.description.executor).executor->add_node(node);
  // After add_node(): a new entity reaches the executor before this listener.
  node->add_listener(*this);
  begin(loaded);
}

void ContainerExecutors::displace(Loaded& loaded) {
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
    // Own code, not the user's: so `isolated` waits for the node's thread, and then keeps nothing
    // of the node.
    const detail::Running running{&loaded.displacement, detail::Running::Code::own};
    Loaded::Displacement now = none;
    ~End() {
      loaded.displacement.store(now);
      detail::WaitInCallback::notify_progress();
    }
  } end{loaded};
  const std::shared_ptr<Node>& node = loaded.node();
  node->remove_listener(*this);
  std::vector<std::shared_ptr<CallbackGroup>> removed;
  try {
    for (const auto& group : node->groups()) {
      const std::string own = loaded.own_executor(*group);
      if (own.empty() || !is_placed_alone(*group)) continue;
      find(own).executor->remove_callback_group(group, node);
      removed.push_back(group);
    }
    find(loaded.description.executor).executor->remove_node(node);
  } catch (...) {  // an executor refuses: restore the state before
    for (const auto& group : removed) {
      find(loaded.own_executor(*group)).executor->add_callback_group(group, node);
    }
    node->add_listener(*this);
    throw;
  }
  end.now = done;
}

// displace() would fail as well, but only after the node was brought down.
void ContainerExecutors::check_removable(const Loaded& loaded) const {
  std::vector<std::string> used{setting_.overrides.executor};
  if (!setting_.overrides.is_merged()) {
    used = {loaded.description.executor.empty() ? kDefaultExecutor : loaded.description.executor};
    for (const auto& group : loaded.node()->groups()) used.push_back(loaded.own_executor(*group));
  }
  for (const auto& running : running_) {
    if (running->is_own || std::find(used.begin(), used.end(), running->name) == used.end() ||
        !executors().traits(running->description.type).frozen) {
      continue;
    }
    throw Error(fmt::format("executor '{}' is static: nothing can be removed after its first spin",
                            running->name),
                "choose 'single_threaded'");
  }
}

// ---- First callbacks ----

void ContainerExecutors::begin(const Loaded& loaded) {
  for (const auto& entity : loaded.node()->entities()) begin(loaded, *entity->group());
}

void ContainerExecutors::begin(const Loaded& loaded, const CallbackGroup& group) {
  // Any other group is for an executor that the user's code makes.
  if (!loaded.own_executor(group).empty() || group.automatically_add_to_executor())
    begin(find(loaded.executor_of(group)));
}

void ContainerExecutors::begin(RunningExecutor& running) {
  if (running_.spin(running)) setting_.note(running.note());
}

void ContainerExecutors::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  const auto loaded = components_.find(node.fully_qualified_name());
  if (loaded == nullptr) return;
  setting_.modes->serve_as_in_force(loaded->node());
  begin(*loaded, *entity->group());
  // A group that was destroyed and created again with its name runs on the executor of its node.
  if (!loaded->own_executor(*entity->group()).empty()) begin(find(loaded->description.executor));
}

}  // namespace takt
