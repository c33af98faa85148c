// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/file_threads.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/workers_policy.hpp"

namespace takt {
namespace {

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Whether the thread has a priority inside the band, and may run on the band's CPU.
bool may_run_inside(const ThreadAttributes& thread, const ThreadAttributes& lowest,
                    const ThreadAttributes& highest) {
  const auto& cpus = thread.affinity;
  return (thread.policy == ThreadPolicy::fifo || thread.policy == ThreadPolicy::rr) &&
         thread.priority >= lowest.priority && thread.priority <= highest.priority &&
         (cpus.empty() ||
          std::find(cpus.begin(), cpus.end(), lowest.affinity.front()) != cpus.end());
}

}  // namespace

void FileThreads::add(const ThreadAttributes& thread, int line) {
  if (all_.try_emplace(thread.name, Entry{thread, line}).second) return;
  errors_.add(line, fmt::format("thread '{}' is one of a band's", thread.name),
              "give it another name");
}

std::vector<ThreadAttributes> FileThreads::band(const ThreadAttributes& lowest, int highest,
                                                bool is_sound, int line) {
  std::vector<std::string>& names = bands_[lowest.name];
  std::vector<ThreadAttributes> threads;
  if (!is_sound) return threads;
  const auto refuse = [&](const std::string& what, const char* remedy) {
    errors_.add(line,
                fmt::format("the band {}..{} of thread '{}' {}", lowest.priority, highest,
                            lowest.name, what),
                remedy);
    return threads;
  };
  if (lowest.policy != ThreadPolicy::fifo) {
    return refuse(fmt::format("is one of {}", to_string(lowest.policy)),
                  "choose `policy: SCHED_FIFO`");
  }
  if (lowest.affinity.size() != 1) {
    return refuse("is not on one CPU", "add one, such as `affinity: [0]`");
  }
  const auto levels = static_cast<std::size_t>(std::max(0, highest - lowest.priority + 1));
  if (levels < 2 || levels > kMostWorkers || highest > 99) {
    return refuse(fmt::format("does not have 2 to {} priorities of 1 to 99", kMostWorkers),
                  "write the lowest one first, such as 60..68");
  }
  for (int priority = lowest.priority; priority <= highest; ++priority) {
    ThreadAttributes& thread = threads.emplace_back(lowest);
    thread.name = fmt::format("{}-{}", lowest.name, priority);
    thread.priority = priority;
    names.push_back(thread.name);
  }
  return threads;
}

ThreadAttributes FileThreads::find(const std::string& name, int line) {
  if (const auto found = all_.find(name); found != all_.end()) return found->second.attributes;
  if (bands_.contains(name)) {
    errors_.add(line, fmt::format("thread '{}' has a band of priorities", name),
                "name one with one priority; a band is for executors of the type `preemptive`");
    return {};
  }
  std::vector<std::string> names;
  for (const auto& [known, entry] : all_) names.push_back(known);
  errors_.add(line, fmt::format("no thread is called '{}'", name),
              names.empty() ? "describe it under 'threads'" : suggest(name, names));
  return {};
}

std::vector<std::string> FileThreads::of_executor(const std::string& name,
                                                  const ExecutorDescription& executor, int line) {
  const auto refuse = [&](const std::string& what, const char* remedy) {
    errors_.add(line, what, remedy);
  };
  const bool takes_band =
      executors().knows(executor.type) && executors().traits(executor.type).takes_band;
  const auto band = bands_.find(name);
  if (band == bands_.end()) {
    if (takes_band && all_.contains(name)) {
      refuse(
          fmt::format("thread '{}' has one priority, and executor '{}' of type '{}' takes a band",
                      name, executor.name, executor.type),
          "write a band, such as `priority: 60..68`");
    }
    return {name};
  }
  if (!takes_band) {
    refuse(fmt::format("thread '{}' has a band of priorities, which executor '{}' of type '{}' "
                       "does not take",
                       name, executor.name, executor.type),
           "give it one priority, or choose `type: preemptive`");
    return {};
  }
  const auto [owner, is_new] = owners_.try_emplace(name, executor.name);
  if (!is_new) {
    refuse(fmt::format("the band of thread '{}' is executor '{}'s", name, owner->second),
           "give each executor its own");
  }
  return band->second;
}

void FileThreads::check_bands() {
  for (const auto& [name, names] : bands_) {
    if (names.empty()) continue;
    const ThreadAttributes& lowest = all_.at(names.front()).attributes;
    const ThreadAttributes& highest = all_.at(names.back()).attributes;
    for (const auto& [other, entry] : all_) {
      if (has(names, other) || !may_run_inside(entry.attributes, lowest, highest)) continue;
      errors_.add(entry.line,
                  fmt::format("thread '{}' may run on CPU {} with priority {}, inside the band "
                              "{}..{} of '{}'",
                              other, lowest.affinity.front(), entry.attributes.priority,
                              lowest.priority, highest.priority, name),
                  "give it a priority outside of the band, or another CPU");
    }
  }
}

}  // namespace takt
