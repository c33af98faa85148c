// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/replace_executors.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"

namespace takt {
namespace {

const std::vector<int>& cpus_of(const SystemDescription& system) {
  return system.machine.cpus.empty() ? available_cpus() : system.machine.cpus;
}

// A band for an executor type that replaces the file's: from the most urgent of these threads to
// below the next other thread that may run on the same CPU. Inside the band, that thread would run
// before some of the callbacks and after others.
std::vector<ThreadDescription> band_from(const std::vector<ThreadAttributes>& threads,
                                         const SystemDescription& system) {
  constexpr int kLevels = 8, kHighest = 99;
  const auto best = std::max_element(threads.begin(), threads.end(), [](auto& a, auto& b) {
    return a.priority < b.priority;  // others than SCHED_FIFO and SCHED_RR have none
  });
  if (best == threads.end() || best->priority == 0) return {};
  const int cpu = best->affinity.empty() ? cpus_of(system).front() : best->affinity.front();
  int highest = std::min(best->priority + kLevels - 1, kHighest);
  for (const ThreadDescription& entry : system.threads) {
    const ThreadAttributes& other = entry.attributes;
    const auto& cpus = other.affinity;
    const bool is_own = std::any_of(threads.begin(), threads.end(),
                                    [&](const auto& own) { return own.name == other.name; });
    const bool meets = cpus.empty() || std::find(cpus.begin(), cpus.end(), cpu) != cpus.end();
    if (is_own || !meets || other.priority < best->priority) continue;
    highest = std::min(highest, std::max(other.priority - 1, best->priority));
  }
  std::vector<ThreadDescription> band;
  for (int priority = best->priority; priority <= highest; ++priority) {
    ThreadAttributes& thread = band.emplace_back(ThreadDescription{*best, {}}).attributes;
    thread.name = fmt::format("{}-{}", best->name, priority);
    thread.policy = ThreadPolicy::fifo;
    thread.priority = priority;
    thread.affinity = {cpu};
  }
  return band;
}

// The names of the threads of all executors of the system.
std::vector<std::string> threads_of(const SystemDescription& system) {
  std::vector<std::string> names;
  for (const ExecutorDescription& executor : system.executors)
    names.insert(names.end(), executor.threads.begin(), executor.threads.end());
  return names;
}

// Copies the threads of the executor from `other`. Renames a thread if the system has one of this
// name, and binds it to the first CPU of the system if that lacks a CPU of its affinity.
void take_threads(const SystemDescription& other, ExecutorDescription& executor,
                  SystemDescription& system) {
  std::map<std::string, std::string> taken;  // by the name in `other`
  for (std::string& name : executor.threads) {
    const ThreadDescription* const thread = find_thread(other, name);
    if (thread == nullptr) continue;
    if (const auto known = taken.find(name); known != taken.end()) {
      name = known->second;
      continue;
    }
    std::string& free = taken[name] = name;
    for (int i = 2; find_thread(system, free) != nullptr; ++i) free = fmt::format("{}-{}", name, i);
    system.threads.push_back(*thread);
    ThreadAttributes& attributes = system.threads.back().attributes;
    attributes.name = free;
    name = free;
    const std::vector<int>& cpus = cpus_of(system);
    const bool has_all = std::all_of(
        attributes.affinity.begin(), attributes.affinity.end(),
        [&](int cpu) { return std::find(cpus.begin(), cpus.end(), cpu) != cpus.end(); });
    if (!has_all) attributes.affinity = {cpus.front()};
  }
}

void give_threads(ExecutorDescription& executor, const SystemDescription& other,
                  SystemDescription& system) {
  const std::size_t least = executor.threads.size();
  std::vector<std::string> own = threads_of(system);
  if (own.empty()) return take_threads(other, executor, system);
  const ExecutorTraits traits = executors().traits(executor.type);
  const bool has_band =
      system.executors.size() == 1 && executors().traits(system.executors.front().type).takes_band;
  if (traits.takes_band && has_band) {
    executor.threads = std::move(own);
    return;
  }
  if (traits.takes_band) {
    const ExecutorDescription as_other = executor;
    executor.threads = std::move(own);
    const std::string differs = take_band(executor, system);
    if (executor.threads.size() == 1)
      system.notes.push_back(fmt::format("executor '{}' runs {}", executor.name, differs));
    if (!executor.threads.empty()) return;
    executor = as_other;  // no thread has a priority
    return take_threads(other, executor, system);
  }
  const std::size_t count = least > 1         ? std::max(least, own.size())
                            : traits.isolates ? own.size()
                                              : 1;
  own.resize(count, own.back());
  executor.threads = std::move(own);
}

void clear_priorities(ComponentDescription& component) {
  for (auto& [name, group] : component.callback_groups) group.parameters.priority.reset();
  for (auto& [name, callback] : component.callbacks) callback.parameters.priority.reset();
}

}  // namespace

std::string take_band(ExecutorDescription& executor, SystemDescription& system) {
  std::vector<ThreadAttributes> own;
  for (const std::string& name : executor.threads) {
    if (const ThreadDescription* const found = find_thread(system, name))
      own.push_back(found->attributes);
  }
  const std::vector<ThreadDescription> band = band_from(own, system);
  executor.threads.clear();
  if (band.empty()) return "where nothing interrupts: its threads have no priority";
  for (const ThreadDescription& level : band) {
    system.threads.push_back(level);
    executor.threads.push_back(level.attributes.name);
  }
  if (band.size() == 1)
    return fmt::format("on '{}', where nothing interrupts: no priority above it is free",
                       executor.threads.front());
  return fmt::format("on the band '{}' to '{}' instead of its threads", executor.threads.front(),
                     executor.threads.back());
}

std::string why_it_fits_no_other(const SystemDescription& system) {
  if (system.executors.empty())
    return system.finds_chains || !system.chains.empty() ? "" : "it has no executor, and no chains";
  if (system.executors.size() > 1) return "it says which components go to which executor";
  const ExecutorDescription& executor = system.executors.front();
  if (!executor.order.empty()) return "its `order` names callbacks";
  if (!executor.trigger.one.empty()) return "its `trigger` names a callback";
  for (const std::string& name : executor.threads) {
    const ThreadDescription* const thread = find_thread(system, name);
    if (thread != nullptr && thread->attributes.policy == ThreadPolicy::deadline)
      return "its thread has a reservation for its own callbacks";
  }
  return "";
}

void throw_unfit(const std::string& name, const std::string& why) {
  throw Error(fmt::format("{} fits no other file: {}", name, why),
              "copy its `executors`, and name your own callbacks");
}

SystemDescription replace_executors(SystemDescription system, const SystemDescription& other) {
  if (const std::string why = why_it_fits_no_other(other); !why.empty())
    throw_unfit(other.file, why);
  std::string name;  // of the executor; empty: Takt assigns executors
  if (other.executors.empty()) {
    system.finds_chains = system.finds_chains || system.chains.empty();
    system.executors.clear();
  } else {
    ExecutorDescription executor = other.executors.front();
    name = executor.name;
    give_threads(executor, other, system);
    system.executors = {std::move(executor)};
  }
  for (const auto& [scheduler, values] : other.schedulers) system.schedulers[scheduler] = values;
  for (ComponentDescription& component : system.components) {
    component.executor = name;
    for (auto& [group_name, group] : component.callback_groups) group.executor.clear();
    if (other.priorities) clear_priorities(component);
  }
  if (other.priorities) system.priorities = other.priorities;
  return system;
}

}  // namespace takt
