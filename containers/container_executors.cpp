// The executors that a container makes, and what runs on which.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/counted.hpp"
#include "takt/containers/configuration/replace_executors.hpp"
#include "takt/containers/container_parts.hpp"

namespace takt {
namespace {

// Makes the executor one of the overriding type. Returns how it is not as the file has it.
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

}  // namespace

void Container::make_executor(const ExecutorDescription& executor) {
  ExecutorDescription made = executor;
  std::string differs = override(made, overrides_);
  ExecutorOptions options = options_of(made);
  options.scheduler_own = own_values_of(scheduler_of(made), description_);
  options.realtime = description_.realtime;
  options.statistics = overrides_.statistics;
  options.trace_events = overrides_.trace_events;
  options.slices = overrides_.slices;
  options.watchdog = watchdog_;
  options.clock = overrides_.clock;
  options.execution_model = overrides_.execution_model;
  options.limits_chains = limits_chains(description_);
  const ExecutorTraits traits = executors().traits(made.type);
  const bool has_band = executors().traits(executor.type).takes_band;  // of the file
  if (!overrides_.executor.empty() && traits.takes_band && !has_band)
    differs = take_band(made, description_);
  for (const std::string& name : made.threads) {
    if (options.threads.size() < traits.max_threads) options.threads.push_back(thread(name));
  }
  RunningExecutor& running = executors_->add(made.name, executors().make(made.type, options));
  running.description = std::move(made);
  running.differs = std::move(differs);
}

// Whether a component or a group needs the executor `default`, and the file does not describe it.
bool Container::needs_default_executor() const {
  if (std::any_of(description_.executors.begin(), description_.executors.end(),
                  [](const auto& executor) { return executor.name == kDefaultExecutor; })) {
    return false;
  }
  const auto uses_default = [](const ComponentDescription& component) {
    return component.executor.empty() || component.executor == kDefaultExecutor ||
           std::any_of(component.callback_groups.begin(), component.callback_groups.end(),
                       [](const auto& group) { return group.second.executor == kDefaultExecutor; });
  };
  return std::any_of(description_.components.begin(), description_.components.end(), uses_default);
}

void Container::make_executors() {
  if (!overrides_.is_merged()) {
    for (const ExecutorDescription& executor : description_.executors) make_executor(executor);
    if (needs_default_executor()) make_executor({.name = kDefaultExecutor});
    return;
  }
  // It uses the threads of the file in their order, then assigned ones.
  ExecutorDescription all{.name = overrides_.executor};
  for (const ExecutorDescription& executor : description_.executors) {
    all.threads.insert(all.threads.end(), executor.threads.begin(), executor.threads.end());
  }
  make_executor(all);
}

std::vector<std::string> Container::executor_names() const {
  std::vector<std::string> names;
  for (const auto& running : *executors_) {
    if (!running->is_own) names.push_back(running->name);
  }
  return names;
}

void Container::place_components() {
  for (const auto& loaded : loaded_components()) place(*loaded);
  if (!overrides_.executor.empty()) return;  // a comparison shows how another type fails
  for (std::string& error : too_much_for_executors(*shared_.lock())) {
    errors_.push_back(std::move(error));
  }
  check_listed_callbacks();
}

// The container's own callbacks allocate memory, so they run apart from the components.
Executor& Container::make_own_executor(const char* name, std::size_t threads) {
  std::vector<ThreadAttributes> attributes(threads, thread(name));
  for (std::size_t i = 1; i < threads; ++i) attributes[i].name = fmt::format("{}-{}", name, i);
  RunningExecutor& running =
      executors_->add(name, executors().make("events", {.name = name,
                                                        .threads = std::move(attributes),
                                                        .realtime = description_.realtime,
                                                        .statistics = StatisticsLevel::off,
                                                        .clock = overrides_.clock}));
  running.is_own = true;
  return *running.executor;
}

// ---- First callbacks ----

RunningExecutor& Container::executor_for(const std::string& name) const {
  // The reader or load() has checked the name.
  return overrides_.is_merged() ? **executors_->begin()
                                : executors_->named(name.empty() ? kDefaultExecutor : name);
}

void Container::FirstCallbacks::begin(const Loaded& loaded) {
  for (const auto& entity : loaded.node()->entities()) begin(loaded, *entity->group());
}

void Container::FirstCallbacks::begin(const Loaded& loaded, const CallbackGroup& group) {
  const std::string own = loaded.own_executor(group);
  if (own.empty() && !group.automatically_add_to_executor()) return;  // it is the user's
  begin(container_.executor_for(own.empty() ? loaded.description.executor : own));
}

void Container::FirstCallbacks::begin(RunningExecutor& running) {
  if (!container_.executors_->spin(running) || running.differs.empty()) return;
  container_.note(fmt::format("executor '{}' is '{}' here, {}", running.name,
                              running.description.type, running.differs));
}

void Container::FirstCallbacks::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  const auto loaded = container_.shared_.lock()->find(node.fully_qualified_name());
  if (loaded == nullptr) return;
  container_.serve_as_in_present_mode(loaded->node());
  begin(*loaded, *entity->group());
  // A group that was made again under its name is on the executor of its node.
  if (!loaded->own_executor(*entity->group()).empty()) {
    begin(container_.executor_for(loaded->description.executor));
  }
}

}  // namespace takt
